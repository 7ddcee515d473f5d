#!/usr/bin/env bash
# pose-format: a change of the frame rate fills gaps of any length, with confidences that were never measured, up to more than 1.
#
# `interpolate` of pose-format 0.15.0 runs one cubic spline through the coordinates and the confidence of each point, over all frames where it was
# seen. A hand that is hidden for two seconds is filled like a single frame, none of it stays masked, and there is no limit to set. The confidence of
# the filled frames is the spline too: beside measured values up to 1 it gives more than 1.5 here, so no threshold finds the invented points.
#
# Guessed before: hidden points stay masked in the frames of the new rate.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet pose-format==0.15.0 scipy==1.17.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np
from pose_format import Pose
from pose_format.numpy import NumPyPoseBody
from pose_format.pose_header import PoseHeader, PoseHeaderComponent, PoseHeaderDimensions

# 4 s at 30 frames per second. The hand rests at x = 500, is hidden from frame 30 to 89, and rests there again.
frames = np.arange(120)
places = np.full((120, 1, 1, 2), 500, dtype=np.float32)
confidence = np.full((120, 1, 1), 0.9, dtype=np.float32)
confidence[27:30, 0, 0], confidence[90:93, 0, 0] = (0.92, 0.95, 0.99), (0.99, 0.95, 0.92)
places[27:30, 0, 0, 0], places[90:93, 0, 0, 0] = (501, 503, 506), (506, 503, 501)
confidence[30:90] = 0
hand = PoseHeaderComponent("HAND", ["WRIST"], [], [(255, 0, 0)], "XYC")
pose = Pose(PoseHeader(0.2, PoseHeaderDimensions(1000, 1000, 0), [hand]), NumPyPoseBody(30.0, places, confidence))
assert pose.body.data.mask[30:90].all()

body = pose.interpolate(25.0).body
middle = slice(26, 74)
x, sure = body.data[middle, 0, 0, 0], body.confidence[middle, 0, 0]
print(f"hidden frames: x {x.min():.0f} to {x.max():.0f}, confidence {sure.min():.2f} to {sure.max():.2f}, masked {int(np.ma.getmaskarray(x).sum())}")
assert not np.ma.getmaskarray(body.data).any()
assert sure.max() > 1.5 and x.max() > 550
PYTHON
