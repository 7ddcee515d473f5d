#!/usr/bin/env bash
# mgen: a rotation in the plane of two vectors turns the other way, unless the two are exactly at right angles.
#
# rotation_from_angle_and_plane of mgen 1.2.1 takes two vectors that span a plane, of any length, and an angle. With
# (1, 0, 0) and (0, 1, 0) it turns from the first to the second. With (1, 0, 0) and (0.1, 1, 0) it turns by the same
# angle from the second to the first. So it does with (1, 2, 3) and (3, 0, -1), which are at right angles but for the
# rounding of their lengths. Two segments of a limb get the inverse of what the axes of a frame get. Nothing is said.
#
# Guessed before: from the first vector to the second, whatever the angle between them.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps mgen==1.2.1 pbr==7.1.3 setuptools==80.9.0
python/bin/python - <<'PYTHON'
import numpy as np
from mgen import rotation_from_angle_and_plane
from scipy.spatial.transform import Rotation

for first, second, right in (
    ([1, 0, 0], [0, 1, 0], True),
    ([2, 0, 0], [0, 3, 0], True),
    ([1, 0, 0], [0.1, 1, 0], False),
    ([1, 0, 0], [-0.1, 1, 0], False),
    ([1, 2, 3], [3, 0, -1], False),
    ([1, 2, 3], [3, -1, 0.5], False),
):
    found = Rotation.from_matrix(rotation_from_angle_and_plane(0.7, np.array(first), np.array(second))).as_rotvec()
    axis = np.cross(first, second)
    turn = found @ axis / np.linalg.norm(axis)
    print(f"from {first} to {second}: by {turn:.3f}, right is 0.700")
    assert np.isclose(turn, 0.7 if right else -0.7), turn
PYTHON
