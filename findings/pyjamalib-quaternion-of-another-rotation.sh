#!/usr/bin/env bash
# pyjamalib: the quaternion of a rotation matrix is that of another rotation for about one in three matrices.
#
# rotMat2quatern of pyjamalib 1.0.0 makes a matrix of four by four whose eigenvector of the largest eigenvalue is the quaternion. It takes the
# second eigenvector of numpy.linalg.eig, which sorts nothing. MATLAB's eig, from which it was carried over, sorts. For the rest of the matrices
# the quaternion belongs to an eigenvalue that is not the largest, and is up to half a turn off. euler2quat goes the same way.
# The way back, quatern2rotMat, is right.
#
# Guessed before: perhaps the conjugate, as in the code of Madgwick, but always the same rotation.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile --no-deps pyjamalib==1.0.0
python/bin/python -m pip install --quiet --no-compile numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 matplotlib==3.11.2
export MPLBACKEND=Agg
python/bin/python -W ignore - <<'PYTHON'
import numpy as np
from pyjamalib import DataProcessing
from scipy.spatial.transform import Rotation


def off(rotation):
    quaternion = np.real(np.asarray(DataProcessing.rotMat2quatern(rotation.as_matrix())))
    back = DataProcessing.quatern2rotMat(quaternion)
    return np.rad2deg((Rotation.from_matrix(back).inv() * rotation).magnitude())


rotations = Rotation.random(500, random_state=1)
there = max(
    np.abs(DataProcessing.quatern2rotMat(one.as_quat()[[3, 0, 1, 2]]).T - one.as_matrix()).max() for one in rotations
)
errors = np.array([off(one) for one in rotations])
wrong = int((errors > 0.01).sum())
print(f"of 500 matrices {wrong} come back as another rotation, up to {errors.max():.0f} degrees off; the way back is right to {there:.0e}")
assert 100 < wrong < 250 and errors.max() > 170 and there < 1e-12
PYTHON
