#!/usr/bin/env bash
# neura-dual-quaternions: its screw interpolation moves along a straight line: a door comes off its hinge.
#
# ScLERP is the motion along one screw: a turn about an axis in space and a shift along it. `sclerp` of
# neura-dual-quaternions 0.0.4 turns evenly, and shifts the origin along the straight line between both places. A door
# handle 1 m from the hinge, a quarter turn on, is 0.71 m from it half way. Of 100 random pairs of poses none follows
# its screw. `power` of the same package does: the first pose times the half power of the way to the second one. Both
# ends and all rotations are right, and so are poses without a turn.
#
# Guessed before: the screw, as the name says.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps neura-dual-quaternions==0.0.4
python/bin/python - <<'PYTHON'
import numpy as np
from neura_dual_quaternions import DualQuaternion
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation


def pose(rotation, place):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), place
    return matrix


def interpolated(first, last, part):
    pair = [DualQuaternion.fromTransformation(matrix) for matrix in (first, last)]
    return np.array(DualQuaternion.sclerp(*pair, part).asTransformation())


def screw(first, last, part):
    return first @ expm(part * logm(np.linalg.inv(first) @ last).real)


shut, open_ = pose(Rotation.identity(), [1, 0, 0]), pose(Rotation.from_rotvec([0, 0, np.pi / 2]), [0, 1, 0])
found, right = interpolated(shut, open_, 0.5), screw(shut, open_, 0.5)
way = DualQuaternion.fromTransformation(np.linalg.inv(shut) @ open_).power(0.5).asTransformation()
print("the handle half way:", found[:3, 3].round(3), "on its screw:", right[:3, 3].round(3))
print("by power:", (shut @ way)[:3, 3].round(3), "distances from the hinge:", np.linalg.norm([found[:3, 3], right[:3, 3]], axis=1))
assert np.allclose(found[:3, 3], [0.5, 0.5, 0]) and np.allclose(found[:3, :3], right[:3, :3])
assert np.allclose(shut @ way, right)

draw = np.random.default_rng(1)
rotations = Rotation.random(200, random_state=1)
follow, straight = 0, 0
for a, b in zip(rotations[:100], rotations[100:]):
    first, last = pose(a, draw.normal(size=3)), pose(b, draw.normal(size=3))
    found = interpolated(first, last, 0.4)
    follow += bool(np.allclose(found, screw(first, last, 0.4), atol=1e-6))
    straight += bool(np.allclose(found[:3, 3], 0.6 * first[:3, 3] + 0.4 * last[:3, 3]))
print(f"of 100 pairs of poses, {follow} follow the screw, {straight} the straight line")
assert (follow, straight) == (0, 100)
PYTHON
