#!/usr/bin/env bash
# pupyC3D: a negative coordinate of an integer C3D file comes back as a large positive one.
#
# A C3D with a positive POINT:SCALE has coordinates as signed 16-bit integers. pupyC3D 0.1.3 reads them as unsigned: -100 mm at a scale of 0.1
# is 6,453.6 mm, and all left of or behind the origin of the room is 65,536 steps away. The residual of a missing point, -1, is 6,553.5, so
# that gaps look like measurements of (0, 0, 0). ezc3d 1.7.2 and c3d 0.6.0 read the same file as written. Files of real numbers are right.
#
# Guessed before: integers read as other readers do.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pupyC3D==0.1.3 ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
python/bin/python -W ignore - <<'PYTHON'
import struct

import c3d
import ezc3d
from pupyC3D import C3DFile


def parameter(name, kind, sizes, value):
    body = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + value + b"\0"
    return struct.pack("<bb", len(name), 1) + name + struct.pack("<H", 2 + len(body)) + body


scale, rate = struct.pack("<f", 0.1), struct.pack("<f", 100)
parameters = b"\1\x50\1\x54" + struct.pack("<bb", 5, -1) + b"POINT" + struct.pack("<H", 3) + b"\0"
parameters += parameter(b"USED", 2, [], struct.pack("<h", 1)) + parameter(b"SCALE", 4, [], scale) + parameter(b"RATE", 4, [], rate)
parameters += parameter(b"DATA_START", 2, [], struct.pack("<h", 3)) + parameter(b"FRAMES", 2, [], struct.pack("<h", 2))
parameters += parameter(b"LABELS", -1, [4, 1], b"heel") + parameter(b"UNITS", -1, [2, 1], b"mm")
header = struct.pack("<BB5H", 2, 0x50, 1, 0, 1, 2, 10) + scale + struct.pack("<HH", 3, 0) + rate
points = struct.pack("<8h", -1000, 2000, 50, 0, 0, 0, 0, -1)  # -100, 200 and 5 mm, then a gap
with open("heel.c3d", "wb") as file:
    file.write(header.ljust(512, b"\0") + parameters.ljust(512, b"\0") + points.ljust(512, b"\0"))

first, gap = C3DFile("heel.c3d").data["POINTS"]["heel"].round(3).tolist()
print("pupyC3D:", first, "gap:", gap)
read = ezc3d.c3d("heel.c3d")["data"]["points"][:3, 0, 0].round(3).tolist()
with open("heel.c3d", "rb") as file:
    second = next(c3d.Reader(file).read_frames())[1][0, :3].round(3).tolist()
print("ezc3d:", read, "c3d:", second)
assert read == second == [-100, 200, 5]
assert first[:3] == [6453.6, 200, 5] and gap == [0, 0, 0, 6553.5]
PYTHON
