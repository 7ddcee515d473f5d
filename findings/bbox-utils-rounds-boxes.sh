#!/usr/bin/env bash
# bbox-utils: boxes are rounded to whole pixels when they are made, so that one given in shares of the image has no size, and YOLO boxes move.
#
# bbox-utils 0.1.1 converts between forms of boxes. It keeps corners as integers of 32 bits. The box from (10.7, 20.9) to (50.6, 100.2) is stored as
# (11, 21) to (51, 100). A box from (0.2, 0.3) to (0.4, 0.45), as shares of the image, has corners (0, 0) and (0, 0). From YOLO to YOLO in an image
# of 203 x 101 pixels the centre goes from (0.5, 0.5) to (0.4975, 0.495). `width` is that of the unrounded box, and not that of the corners.
#
# Guessed before: fractions are kept.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 pyquaternion==0.9.9
python/bin/python -m pip install --quiet --no-compile --no-deps bbox-utils==0.1.1
python/bin/python - <<'PYTHON'
import numpy as np
from bbox_utils import BoundingBox

box = BoundingBox.from_xyxy(np.array([10.7, 20.9]), np.array([50.6, 100.2]))
corners = np.concatenate(box.to_xyxy())
print("corners 10.7 20.9 50.6 100.2 are stored as", corners, "and its width is", round(float(box.width), 3))
assert corners.dtype == np.int32 and corners.tolist() == [11, 21, 51, 100] and abs(box.width - 39.9) < 1e-9
shares = np.concatenate(BoundingBox.from_xyxy(np.array([0.2, 0.3]), np.array([0.4, 0.45])).to_xyxy())
print("corners 0.2 0.3 0.4 0.45 are stored as", shares)
assert not shares.any()
size = np.array([101, 203])
back = BoundingBox.from_yolo(np.array([0.5, 0.5]), 0.333, 0.25, size).to_yolo(size)
print("YOLO 0.5 0.5 0.333 0.25 comes back as", np.round(back, 4))
assert np.allclose(back, [0.4975, 0.495, 0.333, 0.25], atol=1e-4)
PYTHON
