#!/usr/bin/env bash
# pycolmap cuts the names of images at the first space, and takes several images for one name.
#
# pycolmap 4.2.1 reads `images.txt`, whose last column is the name, word by word: `left camera/000000.png` becomes `left`. There is no error, and
# two images of the model may then have one name. A model that pycolmap itself writes with such names does not come back.
#
# Guessed before: the rest of the line, as the format puts the name last.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pycolmap==4.2.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import pathlib

import pycolmap

pathlib.Path("cameras.txt").write_text("1 PINHOLE 640 480 500 500 320 240\n")
pathlib.Path("points3D.txt").write_text("")
pathlib.Path("images.txt").write_text(
    "1 1 0 0 0 0 0 0 1 left camera/000000.png\n\n2 1 0 0 0 0 0 1 1 left camera/000001.png\n\n"
)
names = [image.name for image in pycolmap.Reconstruction(".").images.values()]
print(names)
assert names == ["left", "left"], names
PYTHON
