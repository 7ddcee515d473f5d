#!/usr/bin/env bash
# OpenCV's FileStorage writes whole numbers from 2^31 on as `true`, and cuts matrices of 64 bits to 32.
#
# opencv-python-headless 5.0.0.93: `write("stamp", 1700000000123456789)` puts `stamp: true` into the file, whatever the number, and it comes
# back as 1; 4.14.0.94 writes the number. A matrix of int64 is written as one of int32 with the upper half of each number gone (4.14 does so
# too): 2^40 + 5 is 5. A matrix of uint32 is written right, and read again as 0 from 2^31 on. There is no error. Times in nanoseconds,
# serial numbers of cameras and ids of parts are such numbers. YAML, XML and JSON do the same.
#
# Guessed before: an error, or a floating point number.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet opencv-python-headless==5.0.0.93 numpy==2.4.6
python/bin/python - <<'PYTHON'
import pathlib

import cv2
import numpy as np

for ending in ("yaml", "xml", "json"):
    path = f"cameras.{ending}"
    file = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
    file.write("small", 2**31 - 1)
    file.write("large", 2**31)
    file.write("stamp", 1_700_000_000_123_456_789)
    file.write("signed", np.array([[2**40 + 5, -7]], np.int64))
    file.write("ids", np.array([[2**31 - 1, 2**31, 2**32 - 1]], np.uint32))
    file.release()
    file = cv2.FileStorage(path, cv2.FILE_STORAGE_READ)
    single = {name: file.getNode(name).real() for name in ("small", "large", "stamp")}
    signed, ids = file.getNode("signed").mat(), file.getNode("ids").mat()
    print(ending, single, signed.dtype, signed.tolist(), ids.dtype, ids.tolist())
    assert single == {"small": 2**31 - 1, "large": 1, "stamp": 1}
    assert signed.dtype == np.int32 and signed.tolist() == [[5, -7]]
    assert ids.dtype == np.uint32 and ids.tolist() == [[2**31 - 1, 0, 0]]
    assert "4294967295" in pathlib.Path(path).read_text()
text = pathlib.Path("cameras.yaml").read_text()
print(text)
assert "large: true\nstamp: true\n" in text
PYTHON
