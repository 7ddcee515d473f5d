#!/usr/bin/env bash
# PSpincalc: a turn of 30 degrees about z is, as an Euler vector, one of 150 degrees about x.
#
# DCM2EV, EA2EV and Q2EV of PSpincalc 0.2.7 read the quaternion with its real part last, while the package's other functions put it first. So the
# axis has the real part in it, and the angle comes from z. No message tells. EV2DCM of the vector gives another matrix, for every one of 200
# random rotations. DCM2Q, Q2DCM, DCM2EA and EA2DCM agree with one another.
#
# Guessed before: (0, 0, 1) or (0, 0, -1) and 30 degrees, as its matrices are transposed ones.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile PSpincalc==0.2.7 numpy==2.4.6
python/bin/python -W ignore - <<'PYTHON'
import contextlib
import io

import numpy as np
import PSpincalc


def quiet(function, *arguments):
    with contextlib.redirect_stdout(io.StringIO()) as said:
        value = np.asarray(function(*arguments))
    return np.squeeze(value), said.getvalue().strip()


sine, cosine = np.sin(np.pi / 6), np.cos(np.pi / 6)
turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
vector, said = quiet(PSpincalc.DCM2EV, turn)
quaternion, _ = quiet(PSpincalc.DCM2Q, turn)
print(f"30 degrees about z: quaternion {quaternion.round(3)}, axis {vector[:3].round(3)}, angle {np.rad2deg(vector[3]):.1f}, message {said!r}")
assert np.allclose(np.abs(quaternion), [np.cos(np.pi / 12), 0, 0, np.sin(np.pi / 12)])
assert np.allclose(np.abs(vector[:3]), [1, 0, 0]) and np.isclose(np.rad2deg(vector[3]), 150) and not said

generator = np.random.default_rng(1)
wrong = right = 0
for _ in range(200):
    matrix, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    matrix *= np.linalg.det(matrix)
    vector, _ = quiet(PSpincalc.DCM2EV, matrix)
    wrong += not np.allclose(quiet(PSpincalc.EV2DCM, vector)[0], matrix, atol=1e-6)
    right += np.allclose(quiet(PSpincalc.Q2DCM, quiet(PSpincalc.DCM2Q, matrix)[0])[0], matrix, atol=1e-6)
print(f"of 200 random matrices {wrong} come back from their Euler vector as another one, and {right} from their quaternion as themselves")
assert wrong == 200 and right == 200
PYTHON
