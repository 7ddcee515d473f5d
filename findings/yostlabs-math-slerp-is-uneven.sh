#!/usr/bin/env bash
# yostlabs-math: interpolation between two orientations moves at an uneven speed, and is up to some degrees off.
#
# slerp of yostlabs-math 2026.3.11 multiplies sin(1 - t) by the angle, where the sine of both is meant. The result is
# scaled to length 1 again, so that it looks like a rotation. From 0 to 172 degrees about z, a quarter of the way is
# at 38.4 degrees, not 43.0. Small turns are off too: of 5.7 degrees a quarter is 1.54, not 1.43. Nothing is said. Two
# equal quaternions, as of a sensor that lies still, are an error (division by zero). Both ends are right.
#
# Guessed before: equal steps, as SciPy's.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps yostlabs-math==2026.3.11
python/bin/python - <<'PYTHON'
import numpy as np
from scipy.spatial.transform import Rotation, Slerp
from yostlabs.math.quaternion import slerp


def about_z(angle):
    return Rotation.from_rotvec([0, 0, angle])


parts = [0, 0.25, 0.5, 0.75, 1]
for end in (3.0, 1.0, 0.1):
    pair = about_z(0).as_quat().tolist(), about_z(end).as_quat().tolist()
    found = np.degrees([Rotation.from_quat(slerp(*pair, part)).as_rotvec()[2] for part in parts])
    right = np.degrees(Slerp([0, 1], Rotation.from_quat(pair))(parts).as_rotvec()[:, 2])
    wrong = np.abs(found - right).max()
    print(f"to {np.degrees(end):.0f} degrees: {found.round(2)}, right {right.round(2)}")
    assert np.allclose(found[[0, -1]], right[[0, -1]])
    assert wrong > 0.01 * np.degrees(end)
try:
    slerp(pair[0], pair[0], 0.5)
    raise SystemExit("equal quaternions are no error any more")
except ZeroDivisionError as error:
    print("equal quaternions:", error)
PYTHON
