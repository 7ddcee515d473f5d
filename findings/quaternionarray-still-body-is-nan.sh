#!/usr/bin/env bash
# quaternionarray: interpolation is NaN where a body is still, and turns the long way where a sign changes.
#
# slerp of quaternionarray 0.6.2 interpolates a list of quaternions to other times. Two equal neighbours give NaN, as
# it divides by the sine of an angle of 0. A quaternion and its negative are one rotation; neighbours of opposite sign
# are joined by the longer arc: from 11 to 57 degrees about z it goes backwards through -67 and -146. `nlerp` has no
# NaN, but takes the long way as well. Recordings have both: a foot on the floor, and a sensor whose quaternions
# change sign. Other neighbours are right. NumPy warns of the NaN only. From NumPy 1.24 on both functions fail.
#
# Guessed before: the shorter way, and always a quaternion of length 1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.23.5 scipy==1.11.4
python/bin/python -m pip install --quiet --no-compile --no-deps quaternionarray==0.6.2
python/bin/python - <<'PYTHON'
import numpy as np
import quaternionarray
from scipy.spatial.transform import Rotation

times, wanted = np.array([0.0, 1.0]), np.array([0.25, 0.5, 0.75])
first, last = (Rotation.from_rotvec([0, 0, angle]).as_quat() for angle in (0.2, 1.0))


def angles(function, *pair):
    with np.errstate(all="ignore"):
        found = function(wanted, times, np.array(pair))
    if np.isnan(found).any():
        return found[:, 2]
    return np.degrees(Rotation.from_quat(found).as_rotvec()[:, 2])


right = np.degrees(0.2 + 0.8 * wanted)
print("right", right.round(1))
for function in (quaternionarray.slerp, quaternionarray.nlerp):
    same, other, still = (angles(function, first, pair) for pair in (last, -last, first))
    print(f"{function.__name__}: same sign {same.round(1)}, opposite sign {other.round(1)}, still {still}")
    assert np.allclose(same, right, atol=0.6)
    assert np.abs(other - right).max() > 90
assert np.allclose(angles(quaternionarray.slerp, first, last), right)
assert np.isnan(angles(quaternionarray.slerp, first, first)).all()
PYTHON
