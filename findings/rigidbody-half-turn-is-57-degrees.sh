#!/usr/bin/env bash
# rigidbody: the logarithm of a half turn is a turn of 57 degrees.
#
# `log` of rigidbody 0.13 gives the axis and angle of a rotation matrix. At exactly half a turn it gives the axis alone, with length 1, which is
# one radian. exp(log(R)) is then another rotation, off by 123 degrees. At 179.9 degrees it is right. A half turn is no rare case: a camera that
# looks back, or a frame with z up that becomes one with z down, is one. There is no message.
#
# Guessed before: log(exp(v)) is v up to pi.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 six==1.17.0
python/bin/python -m pip install --quiet --no-compile --no-deps rigidbody==0.13
python/bin/python - <<'PYTHON'
import numpy as np
from rigidbody import SE3, SO3, rotation

lengths = {}
for degrees in (30, 170, 179.9, 180):
    lengths[degrees] = float(np.degrees(np.linalg.norm(rotation.log(rotation.exp(np.radians(degrees) * np.array([0.6, 0, 0.8]))))))
    print(f"a turn of {degrees} degrees has a logarithm of {lengths[degrees]:.3f} degrees")
assert all(abs(lengths[degrees] - degrees) < 1e-3 for degrees in (30, 170, 179.9))
assert abs(lengths[180] - np.degrees(1)) < 1e-6

down = np.diag([1.0, -1.0, -1.0])
found = rotation.exp(rotation.log(down))
off = np.degrees(np.arccos((np.trace(found @ down.T) - 1) / 2))
print("half a turn about x, by way of its logarithm:\n", found.round(3), f"\nwhich is {off:.1f} degrees off")
assert abs(off - (180 - np.degrees(1))) < 1e-6
assert np.allclose(np.linalg.norm(SO3(down).log()), 1)
PYTHON
