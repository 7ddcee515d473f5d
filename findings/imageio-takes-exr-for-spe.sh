#!/usr/bin/env bash
# imageio reads some OpenEXR files as recordings of a Princeton Instruments camera.
#
# imageio 2.38.1, without a plugin for OpenEXR, tries its plugins one by one. SPE has no signature: it takes any file in which bytes 108 and
# 109 are one of its data types. In an EXR they belong to the list of channels, so it depends on the names and number of channels which
# files are taken: one of positions (X, Y, Z) is. There is no error: an array of another shape comes back, and a warning about a number of
# frames. An EXR with the channel Z alone is refused by name.
#
# Guessed before: an error that names the missing plugin.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet imageio==2.38.1 numpy==2.4.6 OpenEXR==3.5.3
python/bin/python - <<'PYTHON'
import warnings

import imageio.v3 as iio
import numpy as np
import OpenEXR

header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
random = np.random.default_rng(3)


def read(*names):
    channels = {name: random.uniform(2, 5, (120, 160)).astype(np.float32) for name in names}
    OpenEXR.File(header, channels).write("image.exr")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        return iio.imread("image.exr").shape, [str(warning.message).split(" of ")[0] for warning in said]


shape, said = read("X", "Y", "Z")
print("120 rows and 160 columns came back as", shape, said)
assert shape[:2] != (120, 160) and said == ["The file header"]
try:
    print(read("Z"))
    raise SystemExit("Z alone is read")
except OSError as error:
    print("Z alone:", str(error).splitlines()[0])
PYTHON
