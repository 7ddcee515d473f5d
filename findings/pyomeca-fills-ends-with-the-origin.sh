#!/usr/bin/env bash
# pyomeca: a marker that is missing in the first or last frames is put at the origin of the room.
#
# `interpolate_missing_data` of pyomeca 2026.0.2 fills gaps between two measured frames linearly. Gaps at the start or the end, where nothing can
# be interpolated, become 0, 0, 0: the hip at 900 mm starts on the floor and jumps up. The documentation does not say so, and no NaN is left to
# find them by. xarray's own interpolation leaves them missing.
#
# Guessed before: NaN at the ends, or the nearest measured value.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pyomeca==2026.0.2 ezc3d==1.7.2 xarray==2026.9.0 scipy==1.17.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np
from pyomeca import Markers

height = np.array([np.nan, np.nan, 902, 904, np.nan, 908, 910, np.nan])
hip = Markers(np.stack([np.full(8, 300.0), np.full(8, 400.0), height])[:, None, :], channels=["hip"], time=np.arange(8) / 100)
hip = hip.where(~np.isnan(hip.sel(axis="z")))
filled = hip.meca.interpolate_missing_data().values[:3, 0].T.tolist()
plain = hip.interpolate_na(dim="time").values[2, 0]
print("filled:", filled)
print("z by xarray:", plain)
assert filled[:2] == [[0, 0, 0]] * 2 and filled[-1] == [0, 0, 0] and filled[4] == [300, 400, 906]
assert np.isnan(plain[[0, 1, 7]]).all() and plain[4] == 906
PYTHON
