#!/usr/bin/env bash
# mjcf_urdf_simple_converter: a hinge without limits becomes a joint that cannot move, and the range of a hinge with `ref` is moved.
#
# mjcf-urdf-simple-converter 0.7.3 writes every hinge as `revolute` with the range that MuJoCo has for it. Without `range` that is 0 to 0: a wheel
# stands still in every program that keeps limits. (A joint of URDF without limits is `continuous`.) With `ref` MuJoCo counts the angle from
# another pose: a range of -90 to 90 with ref 30 lets the joint turn from -120 to 60 from where it is drawn. In the URDF it is -90 to 90 from there.
# Nothing is said. Places, axes, masses, and limits without `ref` are right.
#
# Guessed before: a joint of the type continuous, and the same reach.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile mjcf-urdf-simple-converter==0.7.3 mujoco==3.16.0 numpy==2.4.6 scipy==1.17.1 numpy-stl==4.1.1
cat > robot.xml <<'ROBOT'
<mujoco model="cart">
  <compiler angle="degree"/>
  <worldbody>
    <body name="cart" pos="0 0 0.2">
      <geom type="box" size="0.3 0.2 0.05" mass="5"/>
      <body name="wheel" pos="0.2 0.2 0">
        <joint name="axle" type="hinge" axis="0 1 0"/>
        <geom type="sphere" size="0.1" mass="1"/>
      </body>
      <body name="arm" pos="0 0 0.1">
        <joint name="shoulder" type="hinge" axis="0 1 0" range="-90 90" ref="30"/>
        <geom type="box" size="0.02 0.02 0.2" mass="1"/>
      </body>
      <body name="mast" pos="-0.2 0 0.1">
        <joint name="turn" type="hinge" axis="0 0 1" range="-45 60"/>
        <geom type="box" size="0.02 0.02 0.2" mass="1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
ROBOT
python/bin/python - <<'PYTHON'
import math
import xml.etree.ElementTree

import mujoco
import numpy
from mjcf_urdf_simple_converter import convert

convert("robot.xml", "robot.urdf")
found = {}
for joint in xml.etree.ElementTree.parse("robot.urdf").findall("joint"):
    if joint.get("type") != "fixed":
        limit = joint.find("limit")
        found[joint.get("name")] = (joint.get("type"), *(round(math.degrees(float(limit.get(end)))) for end in ("lower", "upper")))

model = mujoco.MjModel.from_xml_path("robot.xml")
data = mujoco.MjData(model)


def tilt(angle):
    data.qpos[model.joint("shoulder").qposadr] = math.radians(angle)
    mujoco.mj_kinematics(model, data)
    x, _, z = data.body("arm").xmat.reshape(3, 3)[:, 2]
    return round(math.degrees(numpy.arctan2(x, z)))


print("in MuJoCo the axle has limits:", bool(model.joint("axle").limited[0]), "; the arm goes from", tilt(-90), "to", tilt(90))
print("in the URDF:", found)
assert not model.joint("axle").limited[0] and (tilt(-90), tilt(90)) == (-120, 60)
assert found["axle"] == ("revolute", 0, 0)
assert found["shoulder"] == ("revolute", -90, 90)
assert found["turn"] == ("revolute", -45, 60)
PYTHON
