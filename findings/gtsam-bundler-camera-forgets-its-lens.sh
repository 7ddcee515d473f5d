#!/usr/bin/env bash
# GTSAM's calibration of Bundler cameras has no lens in Python, while a camera that has this calibration projects with one.
#
# gtsam 4.3.0: `uncalibrate` and `calibrate` of `Cal3Bundler(f, k1, k2, u0, v0)` are in Python those of the class below it, which knows only the
# focal length and the centre. k1 and k2 are ignored, without a message. `project` of a camera with this calibration does apply them, so
# a pixel that was projected does not come back to its ray. Cameras of Bundler and BAL files are of this class.
#
# Guessed before: pixels with the lens, as Cal3DS2 and Cal3Fisheye give them.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet gtsam==4.3.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import gtsam
import numpy as np

lens = gtsam.Cal3Bundler(500, -0.2, 0.05, 320, 240)
ray = np.array([0.3, 0.2])
squared = ray @ ray
by_hand = 500 * (1 - 0.2 * squared + 0.05 * squared**2) * ray + [320, 240]
pixel = lens.uncalibrate(ray)
projected = gtsam.PinholeCameraCal3Bundler(gtsam.Pose3(), lens).project(np.array([0.3, 0.2, 1]))
back = lens.calibrate(projected)
print("uncalibrate", pixel, "project", projected, "by hand", by_hand, "calibrate", back, "of the projected", ray)
assert np.allclose(projected, by_hand)
assert np.allclose(pixel, 500 * ray + [320, 240]) and np.abs(pixel - by_hand).max() > 3
assert np.abs(back - ray).max() > 0.005
other = gtsam.Cal3DS2(500, 500, 0, 320, 240, -0.2, 0.05)
assert np.allclose(other.uncalibrate(ray), by_hand) and np.allclose(other.calibrate(by_hand), ray)
PYTHON
