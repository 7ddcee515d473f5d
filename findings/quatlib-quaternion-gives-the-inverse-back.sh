#!/usr/bin/env bash
# quatlib: a rotation matrix that goes to a quaternion and back comes back as its inverse, and its Euler angles with it.
#
# rotMat2quatern of quatlib 0.1.0 gives the quaternion that SciPy gives. quatern2rotMat gives the transposed matrix for it, and quatern2euler the
# angles of that one. Euler angles (0.1, 0.2, 0.3) that go to a matrix, to a quaternion and to angles are (-0.038, -0.220, -0.286). Both functions
# have plain names and say nothing of frames. A joint that is stored as a quaternion so turns the other way. Transpose what comes back.
#
# Guessed before: the round trips are right for random rotations, and the same as SciPy's.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps quatlib==0.1.0
python/bin/python - <<'PYTHON'
import numpy as np
import quatlib
from scipy.spatial.transform import Rotation

back = inverse = same = 0
for rotation in Rotation.random(200, random_state=1):
    matrix = rotation.as_matrix()
    quaternion = quatlib.rotMat2quatern(matrix)
    other = rotation.as_quat()[[3, 0, 1, 2]]
    same += bool(min(abs(quaternion - other).max(), abs(quaternion + other).max()) < 1e-9)
    found = quatlib.quatern2rotMat(quaternion)
    back += bool(np.allclose(found, matrix))
    inverse += bool(np.allclose(found, matrix.T))
print(f"of 200 matrices: {same} have the quaternion of SciPy, {back} come back from it, {inverse} come back as the inverse")
assert (same, back, inverse) == (200, 0, 200)

matrix = quatlib.euler2rotMat(0.1, 0.2, 0.3)
by_matrix = quatlib.rotMat2euler(matrix)
by_quaternion = quatlib.quatern2euler(quatlib.rotMat2quatern(matrix))
print("angles 0.1, 0.2, 0.3: back from the matrix", np.round(by_matrix, 3), "and from its quaternion", np.round(by_quaternion, 3))
assert np.allclose(by_matrix, [0.1, 0.2, 0.3])
assert np.allclose(by_quaternion, quatlib.rotMat2euler(matrix.T))
assert np.allclose(by_quaternion, [-0.038, -0.220, -0.286], atol=1e-3)
PYTHON
