#!/usr/bin/env bash
# qsp-orientation: its complementary filter turns every heading back to 0 within two seconds.
#
# `complementary_filter` of qsp-orientation 0.1.1 corrects an orientation from a gyroscope by an accelerometer, which
# knows where down is, and nothing of the heading. The filter makes an orientation of heading 0 from the accelerometer
# and goes a part of the way there. With `alpha` 0.98, as in the README, 2 percent of the heading are lost with each
# sample. A person who stands still after a turn by 90 degrees has turned back to 12 degrees after one second at 100
# Hz. In a steady turn of 90 degrees a second the heading stays at 44. Tilts are right. Its Mahony and Madgwick filters
# keep the heading. The documentation says that it blends with the tilt.
#
# Guessed before: the heading stays.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3
python/bin/python -m pip install --quiet --no-compile --no-deps qsp-orientation==0.1.1
python/bin/python - <<'PYTHON'
import numpy as np
from qsp.orientation import complementary_filter, integrate_gyro, madgwick_update, mahony_update
from scipy.spatial.transform import Rotation


def quaternion(rotation):
    x, y, z, w = rotation.as_quat()
    return np.array([w, x, y, z])


def angles(values):
    w, x, y, z = values
    return Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)


def heading(values):
    return angles(values)[0]


level = np.array([0.0, 0.0, 9.81])
still = np.zeros(3)
kept = madgwick = mahony = turned = quaternion(Rotation.from_euler("z", 90, degrees=True))
for _ in range(100):
    turned = complementary_filter(integrate_gyro(turned, still, 0.01), level, alpha=0.98)
    madgwick = madgwick_update(madgwick, still, level, dt=0.01)
    mahony = mahony_update(mahony, still, level, dt=0.01)
    mahony = mahony[0] if isinstance(mahony, tuple) else mahony
print(f"one second after a turn by 90: {heading(turned):.1f}, by 90 * 0.98^100 {90 * 0.98**100:.1f}")
assert np.isclose(heading(turned), 90 * 0.98**100, atol=0.1)
assert np.isclose(heading(madgwick), 90, atol=0.1) and np.isclose(heading(mahony), 90, atol=0.1)

# A tilted sensor, of which the filter knows the tilt already: only the heading changes.
tilted = Rotation.from_euler("ZYX", [70, 20, 10], degrees=True)
found = angles(complementary_filter(quaternion(tilted), tilted.inv().apply(level), alpha=0.5))
print("heading, pitch and roll 70 20 10 become", np.round(found, 2))
assert np.allclose(found, [35, 20, 10], atol=0.01)

# A steady turn; a filter that corrects the tilt alone would count on to 900 degrees.
turning = quaternion(Rotation.identity())
alone = quaternion(Rotation.identity())
for _ in range(1000):
    turning = complementary_filter(integrate_gyro(turning, np.array([0, 0, np.pi / 2]), 0.01), level, alpha=0.98)
    alone = integrate_gyro(alone, np.array([0, 0, np.pi / 2]), 0.01)
print(f"after ten seconds of a turn: {heading(turning):.1f}, without the filter {heading(alone):.1f}")
assert np.isclose(heading(turning), 0.9 * 0.98 / 0.02, atol=0.5) and np.isclose(heading(alone), 180, atol=0.1)
PYTHON
