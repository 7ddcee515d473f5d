#!/usr/bin/env bash
# kinpy turns a joint whose axis is not given about z; by the format it is x.
#
# The axis of a URDF joint may be left out, and is then "1 0 0". kinpy 0.6.1 takes "0 0 1". yourdfpy, MuJoCo, PyBullet and Pinocchio take x. Programs
# that write only what differs from the defaults produce such files. There is no message, and the kinematics are of another robot.
#
# Guessed before: all readers follow this default.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet kinpy==0.6.1 mujoco==4.0.0 yourdfpy==0.0.60 numpy==2.4.6
python/bin/python - <<'PYTHON'
import kinpy
import mujoco
import numpy as np
import yourdfpy

text = """<robot name="arm"><link name="base"/><link name="tip"/><joint name="joint" type="revolute"><parent link="base"/><child link="tip"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""
with open("arm.urdf", "w") as file:
    file.write(text)
robot = yourdfpy.URDF.load("arm.urdf")
robot.update_cfg({"joint": 0.3})
other = robot.get_transform("tip", "base")[:3, :3]
mass = '<robot name="arm"><mujoco><compiler boundmass="1" boundinertia="1"/></mujoco>'
axis = mujoco.MjModel.from_xml_string(text.replace('<robot name="arm">', mass)).jnt_axis[0]
found = kinpy.build_chain_from_urdf(text.encode()).forward_kinematics({"joint": 0.3})["tip"].matrix()[:3, :3]
print("kinpy\n", found.round(3), "\nyourdfpy\n", other.round(3), "\naxis in MuJoCo", axis)
cosine, sine = np.cos(0.3), np.sin(0.3)
assert np.allclose(other, [[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]) and axis.tolist() == [1, 0, 0]
assert np.allclose(found, [[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
PYTHON
