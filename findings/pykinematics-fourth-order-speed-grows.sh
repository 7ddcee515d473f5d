#!/usr/bin/env bash
# pykinematics: the derivative of fourth order grows along the recording: a marker of constant speed 3 has 5 at the start and 22 at the end.
#
# calc_derivative of pykinematics 1.0.1 takes the second or fourth order. With order=4 each sample but the first and last two gets a share of the
# value itself: positions 3 t at 100 Hz give 3, 3, 5, 5.5, 6 ... 22.5, 3, 3, instead of 3 throughout. With order=2 they are right. The settings of
# MimuAngles offer both orders for angular velocity. Take 2, which is the default.
#
# Guessed before: both orders are right, but for the ends.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps pykinematics==1.0.1
python/bin/python - <<'PYTHON'
import numpy as np
from pykinematics.imu.utility import calc_derivative

time = np.arange(40) / 100
found = {order: calc_derivative(3 * time, 0.01, order=order) for order in (2, 4)}
for order, speed in found.items():
    print(f"order {order}: {np.round(speed[:5], 3)} ... {np.round(speed[-5:], 3)}; 3 everywhere is right")
assert np.allclose(found[2], 3)
assert np.allclose(found[4][[0, 1, -2, -1]], 3)
assert np.allclose(found[4][2:-2], 5 + 0.5 * np.arange(36))
raised = calc_derivative(3 * time + 1, 0.01, order=4) - found[4]
print("when all positions are 1 higher, the speeds are higher by", np.unique(raised[2:-2].round(6)))
assert (raised[2:-2] > 10).all()
PYTHON
