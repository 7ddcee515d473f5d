#!/usr/bin/env bash
# Of 300 markers in a C3D file, two readers name 255, one fails, one names all.
#
# A C3D parameter holds at most 255 strings; further names are in LABELS2. ezc3d 1.7.2 splits them when it writes, and does not join them when
# it reads: 255 names beside 300 trajectories. c3d 0.6.0 gives 255 names beside `point_used` of 300. pyomeca 2026.0.2, on top of ezc3d, fails
# with xarray's error of conflicting sizes. kineticstoolkit 0.17.0, also on top of ezc3d, joins them.
#
# Guessed before: a writer that splits names joins them again when it reads.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet ezc3d==1.7.2 c3d==0.6.0 pyomeca==2026.0.2 kineticstoolkit==0.17.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import c3d
import ezc3d
import kineticstoolkit
import numpy as np
from pyomeca import Markers

written = ezc3d.c3d()
written["parameters"]["POINT"]["RATE"]["value"] = [100.0]
written["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
written["parameters"]["POINT"]["LABELS"]["value"] = tuple(f"marker{index}" for index in range(300))
written["data"]["points"] = np.ones((4, 300, 3))
written.write("many.c3d")

read = ezc3d.c3d("many.c3d")
print("ezc3d", len(read["parameters"]["POINT"]["LABELS"]["value"]), "names,", read["data"]["points"].shape[1], "trajectories")
assert len(read["parameters"]["POINT"]["LABELS"]["value"]) == 255 and read["data"]["points"].shape[1] == 300
assert len(read["parameters"]["POINT"]["LABELS2"]["value"]) == 45
with open("many.c3d", "rb") as file:
    reader = c3d.Reader(file)
    print("c3d", len(reader.point_labels), "names,", reader.point_used, "trajectories")
    assert (len(reader.point_labels), reader.point_used) == (255, 300)
try:
    Markers.from_c3d("many.c3d")
    raise SystemExit("pyomeca reads it")
except ValueError as error:
    print("pyomeca", type(error).__name__, str(error)[:90])
    assert "300" in str(error) and "255" in str(error)
found = kineticstoolkit.read_c3d("many.c3d")["Points"].data
print("kineticstoolkit", len(found), "names")
assert len(found) == 300
PYTHON
