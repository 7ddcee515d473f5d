#!/usr/bin/env bash
# trc-data-reader: where a marker is missing, the next markers of the line take its place.
#
# A TRC file has tabs between its cells, and the three cells of a marker that was not seen are empty. trc-data-reader 0.4.1 splits lines at any
# white space, so empty cells vanish: the coordinates of the second marker go to the first, those of the third to the second, and the last is
# NaN. It says nothing, also with `verbose`. It writes gaps as empty cells itself, so that what it saved comes back with other markers.
#
# Guessed before: NaN for the marker of the empty cells.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet trc-data-reader==0.4.1 c3d==0.6.0 numpy==2.4.6 pandas==3.1.1
python/bin/python - <<'PYTHON'
import math

import pandas
from trc import TRCData

rows = [
    ["PathFileType", "4", "(X/Y/Z)", "gap.trc"],
    "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames".split(),
    ["100", "100", "2", "3", "mm", "100", "1", "2"],
    ["Frame#", "Time", "hip", "", "", "knee", "", "", "ankle", "", ""],
    ["", "", "X1", "Y1", "Z1", "X2", "Y2", "Z2", "X3", "Y3", "Z3"],
    [],
    ["1", "0.00", "1", "900", "3", "4", "500", "6", "7", "100", "9"],
    ["2", "0.01", "", "", "", "4", "500", "6", "7", "100", "9"],
]
with open("gap.trc", "w") as file:
    file.writelines("\t".join(row) + "\n" for row in rows)


def read(path):
    data = TRCData()
    data.load(path, verbose=True)
    return data, {name: data[name][1] for name in data["Markers"]}


data, second = read("gap.trc")
print("second frame:", second)
assert second["hip"] == [4, 500, 6] and second["knee"] == [7, 100, 9] and math.isnan(second["ankle"][0])
cells = pandas.read_csv("gap.trc", sep="\t", skiprows=6, header=None).iloc[1]
assert cells[2:5].isna().all() and list(cells[5:8]) == [4, 500, 6]

data[2] = (0.01, [[math.nan] * 3, [4.0, 500.0, 6.0], [7.0, 100.0, 9.0]])
data.save("again.trc")
assert read("again.trc")[1]["hip"] == [4, 500, 6]
PYTHON
