#!/usr/bin/env bash
# MuJoCo reads the mimic joints of a URDF as constraints of its solver: setting a pose leaves them where they are.
#
# MuJoCo 4.0.0 turns `<mimic joint="first" multiplier="2"/>` into an equality constraint. It acts only while a simulation steps; `mj_kinematics`
# and `mj_forward` place links by `qpos` alone. A motion of joint angles that is replayed through `qpos`, with the mimicking joints left out,
# draws another body without a message. Robot readers such as yourdfpy resolve the same joint in their kinematics.
#
# Guessed before: either ignored with a warning, or resolved in the kinematics.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet mujoco==4.0.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import mujoco
import numpy as np

robot = """<robot name="arm"><mujoco><compiler boundmass="1e-3" boundinertia="1e-6" fusestatic="false"/></mujoco>
<link name="base"/><link name="upper"/><link name="lower"/>
<joint name="first" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="second" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="first" multiplier="2"/></joint></robot>"""
model = mujoco.MjModel.from_xml_string(robot)
data = mujoco.MjData(model)
data.qpos[0] = 0.3
mujoco.mj_forward(model, data)
turn = data.xmat[model.body("lower").id].reshape(3, 3)
heading = float(np.arctan2(turn[1, 0], turn[0, 0]))
print(f"{model.nq} coordinates, {model.neq} constraints; lower link at {heading:.3f} rad, by the file at 0.9 rad")
assert (model.nq, model.neq) == (2, 1) and abs(heading - 0.3) < 1e-9
PYTHON
