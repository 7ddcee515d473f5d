#!/usr/bin/env bash
# PyAcclaim: the last frame of every AMC file is missing, and the skeleton has the name of its last bone.
#
# `loadAMC` of pyacclaim 0.0.1 puts a frame away when the number of the next one comes, so that the last one is read and never put away. Of 120
# frames there are 119, of one there is none. `loadASF` keeps the name of the file in a variable that each bone then overwrites: `asf["name"]` is
# "upperback" in a file that says "subject7". Nothing is said. The frames that are there are right, also their units.
#
# Guessed before: as many frames as the file has, and its name.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pyacclaim==0.0.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import contextlib
import io

from pyacclaim import loadAMC, loadASF

bone = """  begin
    id {id}
    name {name}
    direction 0 1 0
    length 2
    axis 0 0 0 XYZ
    dof rx ry rz
    limits (-20.0 45.0)
           (-30.0 30.0)
           (-30.0 30.0)
  end
"""
with open("subject.asf", "w") as file:
    file.write(""":version 1.10
:name subject7
:units
  mass 1.0
  length 1.0
  angle deg
:documentation
  two bones
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
""")
    file.write(bone.format(id=1, name="lowerback") + bone.format(id=2, name="upperback"))
    file.write(":hierarchy\n  begin\n    root lowerback\n    lowerback upperback\n  end\n")


def read(frames):
    with open("walk.amc", "w") as file:
        file.write(":FULLY-SPECIFIED\n:DEGREES\n")
        for frame in range(1, frames + 1):
            file.write(f"{frame}\nroot {frame} 17 0 0 0 0\nlowerback 1 2 3\nupperback 4 5 6\n")
    with contextlib.redirect_stdout(io.StringIO()):
        skeleton = loadASF("subject.asf")
        motion = loadAMC(skeleton, "walk.amc")
    return skeleton["name"], [pose["root"][0] for pose in motion]


name, places = read(120)
print(f"of 120 frames there are {len(places)}, the last of them at {places[-1]:g}; of one there are {len(read(1)[1])}; the name is {name}")
assert places == list(range(1, 120))
assert read(1)[1] == []
assert name == "upperback"
PYTHON
