#!/usr/bin/env bash
# ezc3d writes 70,000 frames; it reads 65,535 of them again, and c3d none.
#
# The frame numbers of a C3D header have 16 bits; longer recordings need POINT:LONG_FRAMES or TRIAL:ACTUAL_END_FIELD. ezc3d 1.7.2 writes all
# the data (the file is large enough for 70,000 frames) without either and without a warning. ezc3d itself and kineticstoolkit 0.17.0 then
# read 65,535 frames, again without a warning: at 300 Hz, the end of any recording longer than 218 s is gone. c3d 0.6.0 counts to the last
# frame plus one in 16 bits, which is 0 with NumPy 2: it reads no frame, and warns of bytes that remain. So it does with a file of exactly
# 65,535 frames, which the format allows.
#
# Guessed before: an error when writing, or a parameter from which its own reader finds the length.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet ezc3d==1.7.2 c3d==0.6.0 kineticstoolkit==0.17.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import os
import warnings

import c3d
import ezc3d
import kineticstoolkit
import numpy as np

written = ezc3d.c3d()
written["parameters"]["POINT"]["RATE"]["value"] = [300.0]
written["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
written["parameters"]["POINT"]["LABELS"]["value"] = ("head", "foot")
written["data"]["points"] = np.ones((4, 2, 70_000))
written.write("long.c3d")
size = os.path.getsize("long.c3d")
assert size > 70_000 * 2 * 16, size
found = {"ezc3d": ezc3d.c3d("long.c3d")["data"]["points"].shape[2]}
with warnings.catch_warnings(), open("long.c3d", "rb") as file:
    warnings.simplefilter("ignore")
    found["c3d"] = sum(1 for _ in c3d.Reader(file).read_frames())
found["kineticstoolkit"] = len(kineticstoolkit.read_c3d("long.c3d")["Points"].time)
print(size, "bytes;", found)
assert found == {"ezc3d": 65_535, "c3d": 0, "kineticstoolkit": 65_535}
PYTHON
