#!/usr/bin/env bash
# TrueRig: from MJCF to URDF it loses where in a body a joint is, and `ref`, and its report says that nothing was changed.
#
# truerig 0.1.1 promises a report of everything that a conversion changes. A joint of MJCF may be anywhere in its body (`pos`), and count its angle
# from another pose (`ref`). The URDF has the joint at the origin of the body, and the range as if there were no `ref`. The report says PASS, with 0
# errors, 0 warnings, 0 notes. Here the hand is 0.42 m from its place when the shoulder is at 90 degrees. From URDF to MJCF poses are right.
#
# Guessed before: placed right, or named in the report.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile \
    truerig==0.1.1 mujoco==3.16.0 numpy==2.4.6 scipy==1.17.1 trimesh==4.12.2 yourdfpy==0.0.60 lxml==6.1.3
cat > robot.xml <<'ROBOT'
<mujoco model="arm">
  <compiler angle="degree"/>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="arm" pos="0 0 0.5">
        <inertial pos="0 0 0.1" mass="1.5" diaginertia="0.01 0.02 0.025"/>
        <joint name="shoulder" type="hinge" axis="0 1 0" pos="0 0 0.3" range="-90 90"/>
        <body name="hand" pos="0.4 0 0">
          <inertial pos="0 0 0.1" mass="0.5" diaginertia="0.01 0.01 0.01"/>
          <joint name="wrist" type="hinge" axis="0 0 1" range="-90 90" ref="30"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
ROBOT
python/bin/truerig convert robot.xml robot.urdf --report text | tee report.txt
python/bin/python - <<'PYTHON'
import math
import xml.etree.ElementTree

import mujoco
import numpy


def hand(path, shoulder):
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    data.qpos[model.joint("shoulder").qposadr] = math.radians(shoulder)
    mujoco.mj_kinematics(model, data)
    return data.body("hand").xpos.copy()


joints = xml.etree.ElementTree.parse("robot.urdf").findall("joint")
upper = {joint.get("name"): round(math.degrees(float(joint.find("limit").get("upper")))) for joint in joints}
for angle in (0, 90):
    print(f"shoulder at {angle}: hand at {hand('robot.xml', angle).round(3)}, in the URDF at {hand('robot.urdf', angle).round(3)}")
print("upper limit of the wrist, of which 60 degrees are left from the pose as drawn:", upper["wrist"])
assert numpy.allclose(hand("robot.xml", 0), hand("robot.urdf", 0), atol=1e-6)
assert 0.42 < numpy.linalg.norm(hand("robot.xml", 90) - hand("robot.urdf", 90)) < 0.43
assert upper["wrist"] == 90
report = open("report.txt").read()
assert "PASS" in report and "errors=0  warnings=0  notes=0" in report
PYTHON
