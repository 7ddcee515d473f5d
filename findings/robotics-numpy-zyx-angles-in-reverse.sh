#!/usr/bin/env bash
# robotics-numpy: Euler angles by ZYX come back in reverse order, and a half turn about x as one about y.
#
# `SO3.Eul` of robotics-numpy 0.1.0 takes three angles and "ZYX" as SciPy does. `eul` with "ZYX" gives those about x,
# y, z, so that (0.3, 0.5, 0.7) is (0.7, 0.5, 0.3): a rotation 39 degrees away. r2eul is the same. By "ZYZ", the
# default, all come back but half turns about axes across z: about x, the answer is (0, pi, 0), which is one about y.
# `rpy` at a pitch of 90 degrees, which a limb along the floor has, gives angles of a rotation 46 degrees away.
# Nothing is said.
#
# Guessed before: the angles, or others of the same rotation.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps robotics-numpy==0.1.0
python/bin/python - <<'PYTHON'
import numpy as np
from robotics_numpy import SO3
from scipy.spatial.transform import Rotation


def apart(a, b):
    """The angle between two rotations in degrees."""
    return np.degrees((Rotation.from_matrix(a.matrix).inv() * Rotation.from_matrix(b.matrix)).magnitude())


angles = (0.3, 0.5, 0.7)
rotation = SO3.Eul(*angles, convention="ZYX")
assert np.allclose(rotation.matrix, Rotation.from_euler("ZYX", angles).as_matrix())
back = rotation.eul("ZYX")
wrong = apart(rotation, SO3.Eul(*back, convention="ZYX"))
print(f"ZYX: {angles} comes back as {np.round(back, 3)}, {wrong:.0f} degrees away")
assert np.allclose(back, angles[::-1]) and wrong > 25

for name, make, get, rotation, limit in (
    ("ZYZ, a half turn about x", SO3.Eul, SO3.eul, SO3.Rx(np.pi), 179),
    ("rpy, a pitch of 90 degrees", SO3.RPY, SO3.rpy, SO3.RPY(0.3, np.pi / 2, 0.7), 40),
):
    back = get(rotation)
    wrong = apart(rotation, make(*back))
    print(f"{name}: comes back as {np.round(back, 3)}, {wrong:.0f} degrees away")
    assert wrong > limit
PYTHON
