#!/usr/bin/env bash
# OpenEXR's Python package writes other pixels than those of the array, if the array is a view.
#
# OpenEXR 3.5.3 takes the shape of a NumPy array and the address of its first number, and then reads on as if the numbers lay row after row. Of a
# transposed image, a cut-out, every second pixel, or `image[..., ::-1]` (BGR of OpenCV to RGB) it writes other numbers, without an error or a
# warning. A file of a BGR image so has a right red channel, and green and blue from neighbouring pixels. A copy by `numpy.ascontiguousarray`
# is written right.
#
# Guessed before: views are handled as by NumPy, or refused.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet OpenEXR==3.5.3 numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np
import OpenEXR


def again(pixels, name):
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {name: pixels}).write("image.exr")
    return OpenEXR.File("image.exr").channels()[name].pixels


# The views below all end within this memory, whichever way it is read.
memory = np.arange(400, dtype=np.float32)
depth = memory[:96].reshape(8, 12)
colours = memory[:288].reshape(8, 12, 3)
views = {
    "transposed": ("Z", depth.T),
    "cut-out": ("Z", depth[1:5, 2:8]),
    "every second pixel": ("Z", depth[::2, ::2]),
    "BGR to RGB": ("RGB", colours[..., ::-1]),
}
for title, (name, view) in views.items():
    wrong, copied = again(view, name), again(np.ascontiguousarray(view), name)
    print(f"{title}: {(wrong != view).mean():.0%} of the numbers differ; first row {wrong[0].ravel()[:6]}, should be {view[0].ravel()[:6]}")
    assert wrong.shape == view.shape and (copied == view).all()
    following = np.lib.stride_tricks.as_strided(view, view.shape, np.empty(view.shape, np.float32).strides)
    assert (wrong != view).any() and (wrong == following).all()
PYTHON
