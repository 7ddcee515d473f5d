#!/usr/bin/env bash
# rigid-transform-py: the pitch of a quaternion is too large: 40 degrees are 44, 50 are 61, and from 58 on all are 90.
#
# ToEuler of rigid-transform-py 0.1.1 takes the arc sine twice. Roll and yaw are right. The error is 0.08 degrees at a pitch of 12, so that a test
# with small angles passes. Beyond one radian every pitch is 90 degrees. Rotations with such angles look plausible, for a thigh or a camera.
#
# Guessed before: the round trip of a rotation is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps rigid-transform-py==0.1.1
python/bin/python - <<'PYTHON'
import warnings

import numpy as np
from rigid_transform.transform import Quaternion
from scipy.spatial.transform import Rotation

warnings.simplefilter("ignore")
for pitch in (5, 12, 40, 50, 56, 58, 70):
    rotation = Rotation.from_euler("xyz", [10, pitch, 20], degrees=True)
    quaternion = Quaternion(*rotation.as_quat()[[3, 0, 1, 2]])
    assert np.allclose(quaternion.matrix(), rotation.as_matrix())
    roll, found, yaw = np.degrees(quaternion.ToEuler())
    print(f"roll 10, pitch {pitch}, yaw 20: found {roll:.2f}, {found:.2f}, {yaw:.2f}")
    assert np.allclose([roll, yaw], [10, 20])
    expected = 90 if pitch > 57 else np.degrees(np.arcsin(np.radians(pitch)))
    assert abs(found - expected) < 1e-6
PYTHON
