#!/usr/bin/env bash
# robot-format-converter: a robot that goes from URDF to URDF loses roll, pitch and yaw of all joints and inertias, and what its joints mimic.
#
# robot-format-converter 1.0.0 names URDF as implemented for reading and writing, and says that it preserves the structure of a robot. Its reader
# takes `xyz` of an origin and leaves out `rpy`; every joint of the result has `rpy="0 0 0"`. Here the hand, at all angles 0, is 1.3 m from its
# place. `<mimic>` is missing as well, so that the second finger is free. Nothing is said. Positions, axes, limits and masses are right.
#
# Guessed before: the same robot.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile robot-format-converter==1.0.0 yourdfpy==0.0.60 numpy==2.4.6 lxml==6.1.3
cat > robot.urdf <<'ROBOT'
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0 0 0.2" rpy="1.5707963 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/>
    </inertial>
  </link>
  <link name="hand"/>
  <link name="left"/>
  <link name="right"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="upper"/>
    <origin xyz="0 0 1" rpy="0 1.5707963 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="10" velocity="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/>
    <child link="hand"/>
    <origin xyz="0 0.5 0.9" rpy="0.3 0 0.5"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="10" velocity="2"/>
  </joint>
  <joint name="finger" type="prismatic">
    <parent link="hand"/>
    <child link="left"/>
    <origin xyz="0 0.02 0.1"/>
    <axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="10" velocity="2"/>
  </joint>
  <joint name="thumb" type="prismatic">
    <parent link="hand"/>
    <child link="right"/>
    <origin xyz="0 -0.02 0.1"/>
    <axis xyz="0 -1 0"/>
    <limit lower="0" upper="0.04" effort="10" velocity="2"/>
    <mimic joint="finger"/>
  </joint>
</robot>
ROBOT
python/bin/python - <<'PYTHON'
import xml.etree.ElementTree

import numpy
from robot_format_converter import FormatConverter
from yourdfpy import URDF

FormatConverter().convert("robot.urdf", "same.urdf")
hands, mimics, rotations = [], [], []
for path in ("robot.urdf", "same.urdf"):
    robot = URDF.load(path, load_meshes=False, build_scene_graph=True)
    hands.append(robot.get_transform("hand", "base")[:3, 3])
    tree = xml.etree.ElementTree.parse(path)
    mimics.append(len(tree.findall("joint/mimic")))
    rotations.append({origin.get("rpy") for origin in tree.findall(".//origin")} - {None, "0 0 0"})
print("hand at", hands[0].round(3), "and then at", hands[1].round(3))
print("rotations:", sorted(rotations[0]), "and then", sorted(rotations[1]), "; joints that mimic:", mimics)
assert numpy.linalg.norm(hands[0] - hands[1]) > 1.2
assert len(rotations[0]) == 3 and not rotations[1]
assert mimics == [1, 0]
PYTHON
