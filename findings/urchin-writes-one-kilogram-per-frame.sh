#!/usr/bin/env bash
# urchin gives every link without inertia 1 kg and 1 kg m^2, and writes them into the file.
#
# A URDF link without `<inertial>` has no mass: frames of cameras, markers and hands are such links. urchin 0.0.30 makes up 1 kg and an identity
# matrix when it reads one, and `save` writes them as if they were of the robot. Programs that read the file then simulate them: a hand of 0.4 kg with
# three frames weighs 3.4 kg. Other readers find no mass in the file before.
#
# Guessed before: a link without inertia stays one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet urchin==0.0.30 mujoco==4.0.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import pathlib
import warnings

import mujoco
import urchin

warnings.simplefilter("ignore")
frames = "".join(
    f'<link name="{name}"/><joint name="to_{name}" type="fixed"><parent link="hand"/><child link="{name}"/></joint>'
    for name in ("camera", "marker", "grasp")
)
pathlib.Path("before.urdf").write_text(f"""<robot name="hand"><link name="hand"><inertial><mass value="0.4"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>{frames}</robot>""")
urchin.URDF.load("before.urdf").save("after.urdf")


def mass(path):
    return sum(body.mass for body in mujoco.MjSpec.from_file(path).bodies)


found = mass("before.urdf"), mass("after.urdf")
print("MuJoCo finds kg before and after:", found, "; inertials in the file:", pathlib.Path("after.urdf").read_text().count("<inertial>"))
assert abs(found[0] - 0.4) < 1e-9 and abs(found[1] - 3.4) < 1e-9
PYTHON
