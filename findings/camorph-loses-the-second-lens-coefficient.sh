#!/usr/bin/env bash
# camorph: a camera of COLMAP with the model FULL_OPENCV loses its second lens coefficient, and the others move up.
#
# camorph 1.0.0 converts cameras between formats. It reads the lens of FULL_OPENCV as k1, k3, k4, k5, k6: k2 is left
# out, and k3 takes its place, also in what it writes, to COLMAP and to NeRF. A fish-eye camera (OPENCV_FISHEYE)
# becomes an ordinary one in a NeRF file, with the same k1, k2 and k3, which mean another lens. In a file of Meshroom
# that it wrote, it finds no lens, and the principal point half an image away: (630, 370) is (1270, 730). None of this
# has a message, but for images that are missing. Poses and the lens of OPENCV are right.
#
# Guessed before: the same lens and principal point, or an error where a format has no such lens.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 matplotlib==3.9.4 pillow==11.3.0 PyYAML==6.0.4 \
    pyquaternion==0.9.9 rdflib==7.6.0
python/bin/python -m pip install --quiet --no-compile --no-deps camorph==1.0.0
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import copy
import os
import pathlib
import warnings

import numpy as np

warnings.simplefilter("ignore")
import camorph.camorph as camorph

view = "1280 720 1000 990 630 370"
for folder in ("colmap", "written"):
    os.mkdir(folder)
pathlib.Path("colmap/cameras.txt").write_text(
    f"1 FULL_OPENCV {view} 0.1 -0.05 0.002 -0.003 0.01 0.001 0.002 0.003\n"
    f"2 OPENCV_FISHEYE {view} 0.1 -0.05 0.02 -0.01\n"
    f"3 OPENCV {view} 0.1 -0.05 0.002 -0.003\n"
)
pathlib.Path("colmap/images.txt").write_text("".join(f"{i} 1 0 0 0 0.1 0.2 3 {i} {i}.png\n\n" for i in (1, 2, 3)))
pathlib.Path("colmap/points3D.txt").write_text("")


def show(what, cameras):
    print(what)
    for camera in cameras:
        print("   ", camera.model, np.array(camera.principal_point), camera.radial_distortion, camera.tangential_distortion)


read = camorph.read_cameras("COLMAP", os.path.abspath("colmap"))
for camera in read:
    camera.source_image = os.path.abspath(camera.name)
show("COLMAP, as read (model, principal point, radial, tangential):", read)
full, fisheye, plain = read
assert full.radial_distortion == [0.1, 0.01, 0.001, 0.002, 0.003]
assert plain.radial_distortion == [0.1, -0.05] and plain.tangential_distortion == [0.002, -0.003]

camorph.write_cameras("COLMAP", os.path.abspath("written"), copy.deepcopy([full]), file_type="txt")
line = pathlib.Path("written/cameras.txt").read_text().strip().splitlines()[-1]
print("COLMAP, as written again:", line)
assert [float(word) for word in line.split()[8:10]] == [0.1, 0.01]

camorph.write_cameras("NeRF", os.path.abspath("written/transforms.json"), copy.deepcopy(read))
nerf = camorph.read_cameras("NeRF", os.path.abspath("written/transforms.json"))
show("NeRF, written and read:", nerf)
assert fisheye.model == "opencv_fisheye4" and nerf[1].model == "brown"
assert nerf[1].radial_distortion == [0.1, -0.05, 0.02]

camorph.write_cameras("Meshroom", os.path.abspath("written/meshroom.sfm"), copy.deepcopy([plain]))
meshroom = camorph.read_cameras("Meshroom", os.path.abspath("written/meshroom.sfm"))
show("Meshroom, written and read:", meshroom)
assert np.allclose(meshroom[0].principal_point, [1270, 730])
PYTHON
