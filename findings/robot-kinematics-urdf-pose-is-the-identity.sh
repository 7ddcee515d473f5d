#!/usr/bin/env bash
# robot-kinematics: the forward kinematics of a robot from URDF is the identity, whatever the robot and its joints.
#
# URDFKinematics of robot-kinematics 1.1.0 reads names, types and limits of joints, and then follows no link from the base: its chain is empty. With
# any angles the tool is at the base, unturned, without a message. Limits are checked as if all were well. A number of angles that does not fit
# is an error, so the rest looks checked. Only the classes for Denavit-Hartenberg parameters compute a pose.
#
# Guessed before: the pose of the last link, as SciPy's product of the transforms gives it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 matplotlib==3.9.4
python/bin/python -m pip install --quiet --no-compile --no-deps robot-kinematics==1.1.0
cat > arm.urdf <<'URDF'
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="lower"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>
URDF
python/bin/python - <<'PYTHON'
import numpy as np
from robot_kinematics.forward.urdf_kinematics import URDFKinematics
from scipy.spatial.transform import Rotation

robot = URDFKinematics("arm.urdf")
print("the robot as read:", robot.get_robot_info())
for angles in ([0.0, 0.0], [0.5, 0.0], [0.5, -1.0]):
    found = robot.forward_kinematics(np.array(angles)).matrix
    shoulder = Rotation.from_rotvec([0, 0, angles[0]])
    true = np.array([0, 0, 1]) + shoulder.apply([0.5, 0, 0])
    print(f"angles {angles}: the lower arm is at {found[:3, 3]}, right is {true.round(3)}")
    assert np.array_equal(found, np.eye(4)) and not np.allclose(found[:3, 3], true)
assert robot.get_urdf_info()["kinematic_chain"] == []
PYTHON
