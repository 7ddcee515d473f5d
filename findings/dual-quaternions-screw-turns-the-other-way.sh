#!/usr/bin/env bash
# dual-quaternions: for a third of all poses the screw turns the other way, and so do the square root and the power of the pose.
#
# dual_quaternions 0.4.0 takes the angle from pyquaternion, which wraps it to a half turn, but divides the axis by the sine of that angle. Where
# the real part of the quaternion is negative, angle and axis both change sign, and the rotation is the opposite one. Quaternions made from a
# matrix have such a real part for a third of all rotations. A turn of -170 degrees about z becomes one of 170, and its half is 85, not -85.
# The pose itself, products of poses and sclerp are right.
#
# Guessed before: the screw of any pose gives the pose back.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile dual-quaternions==0.4.0 pyquaternion==0.9.9 numpy==2.4.6 scipy==1.17.1
python/bin/python - <<'PYTHON'
import numpy as np
from dual_quaternions import DualQuaternion
from scipy.spatial.transform import Rotation


def matrix(pose):
    return pose.homogeneous_matrix() if callable(pose.homogeneous_matrix) else pose.homogeneous_matrix


def pose(rotation):
    transform = np.eye(4)
    transform[:3, :3] = rotation.as_matrix()
    transform[:3, 3] = [0.1, 0.9, 0.2]
    return transform


def about_z(transform):
    return Rotation.from_matrix(transform[:3, :3]).as_rotvec(degrees=True)[2]


turn = DualQuaternion.from_homogeneous_matrix(pose(Rotation.from_euler("z", -170, degrees=True)))
back = DualQuaternion.from_screw(*turn.screw())
found = [round(about_z(matrix(one)), 6) for one in (turn, back, turn.pow(0.5))]
print(f"about z: {found[0]} degrees; from its own screw {found[1]}; half of it {found[2]}")
assert found == [-170, 170, 85]

poses = [pose(rotation) for rotation in Rotation.random(600, rng=np.random.default_rng(1))]
wrong = root = blend = 0
for one in poses:
    dual = DualQuaternion.from_homogeneous_matrix(one)
    assert np.allclose(matrix(dual), one)
    wrong += not np.allclose(matrix(DualQuaternion.from_screw(*dual.screw())), one)
    root += not np.allclose(matrix(dual.pow(0.5) * dual.pow(0.5)), one)
    half = matrix(DualQuaternion.sclerp(DualQuaternion.identity(), dual, 0.5))
    blend += not np.allclose(half @ half, one)
print(f"of {len(poses)} random poses not given back: screw {wrong}, half twice {root}, half by sclerp twice {blend}")
assert 150 < wrong == root < 250 and blend == 0
PYTHON
