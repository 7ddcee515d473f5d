#!/usr/bin/env bash
# mahotas: resizing or shifting a mask moves it by one pixel up and left, also by a shift of 0.
#
# `mahotas.interpolate.shift` and `zoom`, and `imresize` on top of them, of mahotas 1.4.19 are spline interpolations of
# an image as those of SciPy. Every pixel comes out with the value of its neighbour to the lower right. A shift of 0
# moves a silhouette by one pixel in both directions, and so does `imresize` to the size that it has. The last line
# and column become 0, also those of an image of ones. Fractions of pixels are dropped: after a shift by 1.5 and -0.5
# the edges are as sharp as before. Orders 0 to 5 all do so. Depth and mask, of which only one was resized, do not fit
# any more. `center_of_mass`, `bbox` and `distance` are right.
#
# Guessed before: as SciPy's `shift` and `zoom`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 mahotas==1.4.19
python/bin/python - <<'PYTHON'
import mahotas
import numpy as np
from mahotas import interpolate
from scipy import ndimage

mask = np.zeros((20, 24))
mask[5:10, 8:15] = 1


def middle(image):
    return np.array(ndimage.center_of_mass(image))


for order in range(6):
    for by in ((0, 0), (1, 0), (0, 2)):
        found, right = interpolate.shift(mask, by, order=order), ndimage.shift(mask, by, order=order)
        assert np.allclose(middle(found), middle(mask) + by - 1, atol=1e-6)
        assert np.allclose(middle(right), middle(mask) + by, atol=1e-6)
print("shift by 0: middle from", middle(mask), "to", middle(interpolate.shift(mask, (0, 0))))

# Half pixels: edges should become values between 0 and 1.
found, right = (module.shift(mask, (1.5, -0.5), order=1) for module in (interpolate, ndimage))
print("shift by 1.5 and -0.5: values", np.unique(found.round(6)), "right", np.unique(right.round(6)))
print("middle", middle(found), "right", middle(right))
assert np.allclose(middle(found), middle(mask) + [1, -1]) and set(np.unique(found.round(6))) == {0, 1}
assert np.allclose(middle(right), middle(mask) + [1.5, -0.5])

# To the size that the image has, and an image of ones.
numbers = np.arange(16.0).reshape(4, 4)
same = mahotas.imresize(numbers, (4, 4))
print("resized to its own size:", same.round(6).tolist())
assert np.allclose(same[:3, :3], numbers[1:, 1:]) and np.allclose(same[3], 0) and np.allclose(same[:, 3], 0)
ones = mahotas.imresize(np.ones((5, 5)), (10, 10))
assert np.allclose(ones[:9, :9], 1) and np.allclose(ones[9], 0) and np.allclose(ndimage.zoom(np.ones((5, 5)), 2), 1)
assert np.allclose(mahotas.center_of_mass(mask), middle(mask)) and mahotas.bbox(mask > 0).tolist() == [5, 10, 8, 15]
PYTHON
