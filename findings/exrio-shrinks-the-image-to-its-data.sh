#!/usr/bin/env bash
# exrio: an OpenEXR image whose pixels are the box around a person forgets the size of the whole image when it is saved again.
#
# Renderers store only the box of pixels that are not empty (the data window), and the size of the image apart from it (the display window). exrio
# 0.2.0 reads both, and keeps where the box is, but writes its size as that of the image: 8 x 6 pixels at (20, 15) of 64 x 48 become an image of
# 8 x 6, in which the box starts at (20, 15), wholly outside. Nothing is said. The pixels are right, and so is an image without such a box.
#
# Guessed before: what is loaded and saved has the same windows.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet exrio==0.2.0 OpenEXR==3.5.3 numpy==1.26.4
python/bin/python - <<'PYTHON'
import exrio
import numpy
import OpenEXR

depth = numpy.random.default_rng(1).uniform(1, 5, (6, 8)).astype(numpy.float32)


def window(x, y, right, bottom):
    return numpy.array([x, y], numpy.int32), numpy.array([right, bottom], numpy.int32)


header = {
    "compression": OpenEXR.ZIP_COMPRESSION,
    "type": OpenEXR.scanlineimage,
    "displayWindow": window(0, 0, 63, 47),
    "dataWindow": window(20, 15, 27, 20),
}
with OpenEXR.File(header, {"Z": depth}) as file:
    file.write("before.exr")
exrio.load("before.exr").to_path("after.exr")

found = []
for path in ("before.exr", "after.exr"):
    with OpenEXR.File(path) as file:
        part = file.parts[0]
        found.append([numpy.array(part.header[name]).tolist() for name in ("displayWindow", "dataWindow")])
        assert numpy.array_equal(part.channels["Z"].pixels, depth)
    print(f"{path}: image {found[-1][0]}, data {found[-1][1]}")
assert found == [[[[0, 0], [63, 47]], [[20, 15], [27, 20]]], [[[0, 0], [7, 5]], [[20, 15], [27, 20]]]]
PYTHON
