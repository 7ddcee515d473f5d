#!/usr/bin/env bash
# satellogic-quaternions: `matrix` of a quaternion is that of the inverse of its own rotation vector.
#
# The documentation of `matrix` says that it returns the matrix of "the same rotation". In satellogic-quaternions 0.1.8 a quaternion made of the
# rotation vector (0, 0, 0.5) returns this vector, but its matrix turns x towards -y: it is the transpose of what Rodrigues' formula, SciPy and
# OpenCV make of the vector. `from_matrix` is transposed too, so round trips within the package look right. Who takes a matrix from elsewhere and
# asks for its rotation vector gets the opposite turn.
#
# Guessed before: matrix and vector agree with SciPy.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps satellogic-quaternions==0.1.8
python/bin/python - <<'PYTHON'
import numpy as np
from quaternions import Quaternion
from scipy.spatial.transform import Rotation

vector = np.array([0.0, 0.0, 0.5])
quaternion = Quaternion.from_rotation_vector(vector)
print("documented:", Quaternion.matrix.__doc__.strip())
print("vector", np.round(quaternion.rotation_vector, 3))
print("matrix\n", quaternion.matrix.round(3), "\nSciPy\n", Rotation.from_rotvec(vector).as_matrix().round(3))
assert np.allclose(quaternion.rotation_vector, vector)
assert np.allclose(quaternion.matrix, Rotation.from_rotvec(vector).as_matrix().T)
opposite = 0
for rotation in Rotation.random(100, random_state=1):
    found = np.array(Quaternion.from_matrix(rotation.as_matrix()).rotation_vector)
    opposite += bool(np.allclose(Rotation.from_rotvec(found).as_matrix(), rotation.as_matrix().T, atol=1e-6))
print(f"of 100 matrices of SciPy, {opposite} have the rotation vector of the inverse")
assert opposite == 100
PYTHON
