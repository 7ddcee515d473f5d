#!/usr/bin/env bash
# quaternions (PyPI): the Euler angles of a quaternion are never those that it was made of, and half turns are NaN.
#
# `from_euler` of quaternions 0.6 turns about x, then the new y, then the new z. `get_euler` gives angles about fixed
# axes. (0.1, 0.2, 0.3) comes back as (0.16, 0.16, 0.32); made again, that is 4 degrees away, and for large angles it
# is some other rotation. `from_matrix` of a half turn has NaN or infinite components. `distance` is said to be the
# angular distance: for a quaternion and its negative, one rotation, it is 2, and a turn by 0.5 radians is 0.249 from
# none. Nothing is said.
#
# Guessed before: the same angles; a right quaternion of any matrix; a distance of 0 and of 0.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps quaternions==0.6
python/bin/python - <<'PYTHON'
import numpy as np
from quaternions import Quaternion
from scipy.spatial.transform import Rotation


def scipy(quaternion):
    return Rotation.from_quat([quaternion.x, quaternion.y, quaternion.z, quaternion.w])


small = Quaternion.from_euler([0.1, 0.2, 0.3]).get_euler()
print("(0.1, 0.2, 0.3) comes back as", np.round(small, 3))
returned, away = 0, []
for rotation in Rotation.random(100, random_state=1):
    angles = rotation.as_euler("XYZ")
    first = Quaternion.from_euler(list(angles))
    assert (scipy(first).inv() * rotation).magnitude() < 1e-6
    back = first.get_euler()
    assert np.allclose(back, rotation.as_euler("xyz"))
    returned += bool(np.allclose(back, angles))
    away.append(np.degrees((rotation.inv() * scipy(Quaternion.from_euler(back))).magnitude()))
print(f"of 100 rotations, {returned} have their angles back; made again they are {np.mean(away):.0f} degrees away")
assert returned == 0 and np.mean(away) > 30

with np.errstate(all="ignore"):
    half = Quaternion.from_matrix(np.diag([-1.0, -1.0, 1.0]))
print("a half turn about z:", half)
assert not np.isfinite([half.w, half.x, half.y, half.z]).all()

turn = Quaternion.from_axis_angle([0, 0, 1.0], 0.5)
negative = Quaternion(-turn.w, -turn.x, -turn.y, -turn.z)
none = Quaternion(1, 0, 0, 0)
print(f"distance to its negative {turn.distance(negative):.3f}, of a turn by 0.5 to none {turn.distance(none):.3f}")
assert np.isclose(turn.distance(negative), 2) and np.isclose(turn.distance(none), 0.2493, atol=1e-3)
PYTHON
