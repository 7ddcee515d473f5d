#!/usr/bin/env bash
# robot-kinematics: Euler angles by "zyx" come back with the other sign, and their matrix is the inverse of that by "xyz".
#
# euler_to_rotation_matrix of robot-kinematics 1.1.0 with convention "zyx" gives the transposed matrix of "xyz", which turns by the negative angles.
# rotation_matrix_to_euler with "zyx" reads a matrix as Rx Ry Rz, which is right for it. The two do not belong together: (0.1, 0.2, 0.3) come back
# as (-0.1, -0.2, -0.3). By "xyz", the default, both agree with SciPy's lower-case "xyz". Upper and lower case are the same here.
#
# Guessed before: all orders agree with SciPy one way or the other, and come back.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 matplotlib==3.9.4
python/bin/python -m pip install --quiet --no-compile --no-deps robot-kinematics==1.1.0
python/bin/python - <<'PYTHON'
import numpy as np
from robot_kinematics.core.transforms import euler_to_rotation_matrix, rotation_matrix_to_euler
from scipy.spatial.transform import Rotation

angles = np.array([0.1, 0.2, 0.3])
matrices = {}
for order in ("xyz", "zyx"):
    matrices[order] = euler_to_rotation_matrix(angles, order)
    back = rotation_matrix_to_euler(matrices[order], order)
    print(f"{order}: {angles} come back as {np.round(back, 3)}")
    assert np.allclose(back, angles if order == "xyz" else -angles)
assert np.allclose(matrices["xyz"], Rotation.from_euler("xyz", angles).as_matrix())
assert np.allclose(matrices["zyx"], matrices["xyz"].T)
true = Rotation.from_euler("XYZ", angles).as_matrix()
print("the angles of Rx Ry Rz by zyx:", np.round(rotation_matrix_to_euler(true, "zyx"), 3))
assert np.allclose(rotation_matrix_to_euler(true, "zyx"), angles)
PYTHON
