#!/usr/bin/env bash
# akai-transform: the axis of a half turn is lost unless it is x, y or z, and the rotation becomes none at all.
#
# rmat2rvec of akai-transform 1.0.0 gives an axis and an angle. At half a turn it has 1 for each axis that the matrix leaves in place, and 0 for
# others: about (0.6, 0, 0.8) the axis is (0, 0, 0). The matrix of (0, 0, 0) and 180 degrees is the identity. log_so3 and rmat2quat of the same
# package are right for the same matrix. Modified Rodrigues parameters by rmat2mrp go through it and are zero too.
#
# Guessed before: the right axis at 180 degrees.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps akai-transform==1.0.0
python/bin/python - <<'PYTHON'
import numpy as np
from akai_transform import se3, tf3d
from scipy.spatial.transform import Rotation

wrong = 0
for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [0, -0.6, 0.8], [2 / 3, 2 / 3, 1 / 3]):
    matrix = np.eye(4)
    matrix[:3, :3] = 2 * np.outer(axis, axis) - np.eye(3)
    found, angle = tf3d.rmat2rvec(matrix)
    back = tf3d.rvec2rmat(found, angle)
    right = np.allclose(back, matrix)
    wrong += not right
    print(f"axis {np.round(axis, 2)}: found {found}, {np.degrees(angle):.0f} degrees, parameters {tf3d.rmat2mrp(matrix)}, comes back: {right}")
    assert right == (1 in axis)
    if not right:
        assert not found.any() and not np.asarray(tf3d.rmat2mrp(matrix)).any() and np.allclose(back, np.eye(4))
    assert np.allclose(Rotation.from_rotvec(se3.log_so3(matrix[:3, :3])).as_matrix(), matrix[:3, :3], atol=1e-6)
assert wrong == 3
PYTHON
