#!/usr/bin/env bash
# minexr: of an EXR whose lines are stored from the bottom up it reads one line, and leftover memory.
#
# minexr 1.0.2 reads EXR images that are not compressed, of one part and one type of channel, which is all that its
# README asks for. The lines of such a file may be stored from top to bottom or from bottom to top ("lineOrder"). The
# table of the file says where each line begins. minexr looks up the first line alone, and takes it that the others
# follow. In a file from bottom to top the first line of the image is the last one of the file: it is right, and the
# rest is what was in memory before, without a message, other numbers each time. Such depths are often tiny, and pass
# as "no body". OpenEXR reads both orders right. The attribute `lineOrder` is read, and not used.
#
# Guessed before: the same pixels for both orders.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 minexr==1.0.2 OpenEXR==3.5.3
python/bin/python - <<'PYTHON'
import minexr
import numpy as np
import OpenEXR

depth = 1000 + np.arange(12 * 7, dtype=np.float32).reshape(12, 7)
for order in (OpenEXR.DECREASING_Y, OpenEXR.INCREASING_Y):
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage, "lineOrder": order}
    with OpenEXR.File(header, {"Z": depth}) as file:
        file.write("depth.exr")
    assert np.array_equal(OpenEXR.File("depth.exr").channels()["Z"].pixels, depth)
    with open("depth.exr", "rb") as file:
        found = np.asarray(minexr.load(file).select(["Z"]))[..., 0]
    right = (found == depth).all(axis=1)
    print(order, "lines that are right:", right.sum(), "of", len(right), "- the first values", found[:3, 0])
    if order == OpenEXR.INCREASING_Y:
        assert right.all()
    else:
        # What is in memory is by chance; it is not the image, nor the image upside down.
        assert found.shape == depth.shape and right[0] and not right[1:].all()
        assert not np.array_equal(found, depth[::-1])
PYTHON
