#!/usr/bin/env bash
# ezc3d writes a missing marker as NaN with a good residual.
#
# In C3D a marker that was not seen has a negative residual, mostly with coordinates 0. ezc3d 1.7.2 reads such a point as NaN. When it writes a
# point that is NaN, the file holds NaN as coordinates and the residual 0, that of a point without error: a reader that asks only for the
# residual, as the format says, takes it for measured. c3d 0.6.0 mends it on reading (0, 0, 0 with the residual -1).
#
# Guessed before: the residual -1, as in the files that it reads.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import struct

import c3d
import ezc3d
import numpy as np

points = np.ones((4, 1, 3))
points[:3, 0, 1] = np.nan
written = ezc3d.c3d()
written["parameters"]["POINT"]["RATE"]["value"] = [100.0]
written["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
written["parameters"]["POINT"]["LABELS"]["value"] = ("head",)
written["data"]["points"] = points
written.write("gap.c3d")
with open("gap.c3d", "rb") as file:
    content = file.read()
[block] = struct.unpack("<h", content[16:18])
x, y, z, residual = struct.unpack("<4f", content[(block - 1) * 512 + 16 : (block - 1) * 512 + 32])
print("in the file:", (x, y, z), "residual", residual)
assert np.isnan([x, y, z]).all() and residual == 0
assert ezc3d.c3d("gap.c3d")["data"]["meta_points"]["residuals"][0, 0, 1] == 0
with open("gap.c3d", "rb") as file:
    found = [list(point) for _, frame, _ in c3d.Reader(file).read_frames() for point in frame]
print("c3d:", found[1])
assert found[1][:4] == [0, 0, 0, -1]
PYTHON
