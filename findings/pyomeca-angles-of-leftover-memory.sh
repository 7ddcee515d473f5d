#!/usr/bin/env bash
# pyomeca: angles by y-x-z, and by four further sequences, are whatever was left in memory.
#
# `Angles.from_rototrans` of pyomeca 2026.0.2 takes "all permutations of xyz" by its documentation. For yxz it has no formula: it returns an array
# that was never filled, without an error. So for yxy (the shoulder by ISB), xyx, xzx and yzy. `Rototrans.from_euler_angles` takes all of them, and
# its matrices are right, by SciPy too. They may as well be zeros or earlier angles, which look real.
#
# Guessed before: the angles that the matrix was made of, or an error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pyomeca==2026.0.2 ezc3d==1.7.2 xarray==2026.9.0 scipy==1.17.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import itertools

import numpy as np
from pyomeca import Angles, Rototrans
from scipy.spatial.transform import Rotation

right = np.array([0.3, 0.5, 0.7])
angles = Angles(np.tile(right[:, None, None], (1, 1, 4)))
wrong = {}
for axes in itertools.product("xyz", repeat=3):
    if axes[0] == axes[1] or axes[1] == axes[2]:
        continue
    sequence = "".join(axes)
    frames = Rototrans.from_euler_angles(angles, sequence)
    assert np.allclose(frames.values[:3, :3, 0], Rotation.from_euler(sequence.upper(), right).as_matrix())
    leftover = np.full((3, 1, 4), 123.456)
    del leftover
    found = Angles.from_rototrans(frames, sequence).values[:, 0, 0]
    if not np.allclose(found, right):
        wrong[sequence] = found.round(3).tolist()
print("wrong, as the memory was filled with 123.456 before:", wrong)
assert set(wrong) == {"yxz", "yxy", "xyx", "xzx", "yzy"}
PYTHON
