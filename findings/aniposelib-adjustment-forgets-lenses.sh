#!/usr/bin/env bash
# aniposelib: a bundle adjustment that has nothing to adjust makes pixels square and drops all of a lens but k1.
#
# aniposelib 0.8.0 packs a camera into eight numbers: rotation, translation, one focal length and k1. What `bundle_adjust` unpacks afterwards has
# fx = fy (their mean), and k2, p1, p2, k3 = 0, although the file format and `project` have all of them. Calibrations of other programs,
# with another fy or with p1 and p2, are so changed even by perfect points.
#
# Guessed before: the adjustment optimises fewer numbers, and keeps the others.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet aniposelib==0.8.0 opencv-python-headless==5.0.0.93 numpy==2.4.6
python/bin/python - <<'PYTHON'
import contextlib
import io

import cv2
import numpy as np
from aniposelib.cameras import Camera, CameraGroup

lens = np.array([-0.2, 0.05, 0.001, 0.002, 0.01])
cameras = []
for index in range(3):
    turn = cv2.Rodrigues(np.array([0.0, 2 * np.pi * index / 3, 0]))[0]
    matrix = np.array([[500.0, 0, 320], [0, 520, 240], [0, 0, 1]])
    cameras.append(Camera(matrix, lens, (640, 480), cv2.Rodrigues(turn)[0], np.array([0.0, 0, 4]), str(index)))
group = CameraGroup(cameras)
points = np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3))
images = group.project(points).reshape(3, 200, 2)
with contextlib.redirect_stdout(io.StringIO()):
    group.bundle_adjust(images, verbose=False)
matrix, after = group.cameras[0].get_camera_matrix(), group.cameras[0].get_distortions()
print("fx, fy", matrix[0, 0].round(2), matrix[1, 1].round(2), "(500, 520 before); lens", after.round(4), "before", lens)
assert matrix[0, 0] == matrix[1, 1] and (after[1:] == 0).all()
PYTHON
