#!/usr/bin/env bash
# yourdfpy leaves out that a joint mimics another one when it writes a robot.
#
# yourdfpy 0.0.60 reads `<mimic>` and follows it in its kinematics, but `write_xml_file` does not write it (the function for it is there, nobody
# calls it), nor transmissions, safety controllers and calibrations. In the file that it wrote the joint moves by itself: a robot that was only read
# and written has another number of free joints, and the same angles give another pose. There is no message.
#
# Guessed before: what is read is written again.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet yourdfpy==0.0.60 numpy==2.4.6
python/bin/python - <<'PYTHON'
import pathlib

import numpy as np
import yourdfpy

pathlib.Path("before.urdf").write_text("""<robot name="leg"><link name="hip"/><link name="thigh"/><link name="shank"/>
<joint name="first" type="revolute"><parent link="hip"/><child link="thigh"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="second" type="revolute"><parent link="thigh"/><child link="shank"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="first" multiplier="2" offset="0.1"/></joint></robot>""")
yourdfpy.URDF.load("before.urdf").write_xml_file("after.urdf")


def look(path):
    robot = yourdfpy.URDF.load(path)
    robot.update_cfg({"first": 0.3})
    turn = robot.get_transform("shank", "hip")
    return robot.actuated_joint_names, float(np.arctan2(turn[1, 0], turn[0, 0]))


before, after = look("before.urdf"), look("after.urdf")
print("before", before, "after", after, "'<mimic' in the file:", "<mimic" in pathlib.Path("after.urdf").read_text())
assert before[0] == ["first"] and abs(before[1] - (0.3 + 2 * 0.3 + 0.1)) < 1e-9
assert after[0] == ["first", "second"] and abs(after[1] - 0.3) < 1e-9
assert "<mimic" not in pathlib.Path("after.urdf").read_text()
PYTHON
