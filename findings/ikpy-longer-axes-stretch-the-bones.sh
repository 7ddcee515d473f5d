#!/usr/bin/env bash
# ikpy: a joint whose axis is not of length 1 stretches everything behind it, in robots from MJCF and from URDF.
#
# In MJCF an axis has any length: "0 1 1" is a valid one, and MuJoCo normalises it. ikpy 4.2.1 puts the three numbers
# into the formula of a rotation as they are. About "0 1 1" a quarter turn has the determinant 4, and a hand at 0.30 m
# from the joint comes to 0.42 m; about "0 0 2" it comes to 0.60 m. A slide along "0 1 1" moves 1.41 times as far.
# From URDF, where axes should have length 1, the same comes out. Axes of length 1 are right, and so is an angle of 0.
# Nothing is said.
#
# Guessed before: the positions of MuJoCo, and of a URDF with a slanted axis.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 sympy==1.14.0
python/bin/python -m pip install --quiet --no-compile --no-deps ikpy==4.2.1
python/bin/python - <<'PYTHON'
import warnings

import numpy as np
from ikpy.chain import Chain

MJCF = """<mujoco><worldbody><body name="arm" pos="0 0 1"><joint name="shoulder" type="{kind}" axis="{axis}"/>
<geom size="0.02"/><body name="hand" pos="0.3 0 0"><geom size="0.02"/></body></body></worldbody></mujoco>"""
URDF = """<robot name="arm"><link name="base"/><link name="arm"/><link name="hand"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="{axis}"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="0.3 0 0"/></joint></robot>"""


def hand(name, text, value, **more):
    with open(name, "w") as file:
        file.write(text)
    with warnings.catch_warnings():
        # It warns that the hand is fixed.
        warnings.simplefilter("ignore")
        read = Chain.from_mjcf_file if name.endswith("xml") else Chain.from_urdf_file
        pose = read(name, **more).forward_kinematics([0, value, 0])
    return pose[:3, :3], pose[:3, 3]


def turned(axis, angle):
    """Where the hand is by Rodrigues' formula."""
    axis = np.array(axis.split(), float)
    axis /= np.linalg.norm(axis)
    arm = np.array([0.3, 0, 0])
    along = axis * (axis @ arm)
    return [0, 0, 1] + along + np.cos(angle) * (arm - along) + np.sin(angle) * np.cross(axis, arm)


for axis in ("0 1 1", "0 0 2", "0 0.6 0.8"):
    for name, text in (("arm.xml", MJCF.format(kind="hinge", axis=axis)), ("arm.urdf", URDF.format(axis=axis))):
        more = {"base_elements": ["base"]} if name.endswith("urdf") else {}
        rotation, found = hand(name, text, np.pi / 2, **more)
        right = turned(axis, np.pi / 2)
        reach = np.linalg.norm(found - [0, 0, 1])
        size = np.linalg.det(rotation)
        print(f"{name}, axis {axis}: hand {np.round(found, 3)}, right {np.round(right, 3)}, reach {reach:.3f}, size {size:.2f}")
        assert abs(np.linalg.norm(right - [0, 0, 1]) - 0.3) < 1e-9
        if axis == "0 0.6 0.8":
            assert np.allclose(found, right) and abs(size - 1) < 1e-9
        else:
            assert reach > 0.41 and size > 3.9
        assert np.allclose(hand(name, text, 0, **more)[1], [0.3, 0, 1])
moved = np.linalg.norm(hand("arm.xml", MJCF.format(kind="slide", axis="0 1 1"), 0.1)[1] - [0.3, 0, 1])
print(f"slide by 0.1 along 0 1 1: {moved:.4f}")
assert abs(moved - 0.1 * np.sqrt(2)) < 1e-9
PYTHON
