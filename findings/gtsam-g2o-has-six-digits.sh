#!/usr/bin/env bash
# GTSAM writes poses to g2o files with six digits.
#
# `gtsam.writeG2o` of gtsam 4.3.0 writes every number with six significant digits. What is far from the origin moves: a camera at 5411234.567 m
# of a map grid by 4.5 m, one at 12345.678 mm of a room by 0.02 mm. Turns lose digits too. Its own reader takes what is there; no message.
#
# Guessed before: as many digits as come back to the same number.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet gtsam==4.3.0 numpy==2.4.6
python/bin/python - <<'PYTHON'
import gtsam
import numpy as np

places = np.array([[448765.432, 5411234.567, 123.4567], [12345.678, 0, 0]])
turn = gtsam.Rot3.Rz(0.123456789)
poses = gtsam.Values()
for index, place in enumerate(places):
    poses.insert(index, gtsam.Pose3(turn, place))
gtsam.writeG2o(gtsam.NonlinearFactorGraph(), poses, "poses.g2o")
print(open("poses.g2o").read())
_, again = gtsam.readG2o("poses.g2o", True)
off = [np.abs(again.atPose3(index).translation() - place).max() for index, place in enumerate(places)]
turned = np.abs(turn.between(again.atPose3(0).rotation()).xyz()).max()
print("moved by", np.round(off, 4), "turned by", turned)
assert 4 < off[0] < 5 and 0.02 < off[1] < 0.03 and 1e-8 < turned < 1e-4
PYTHON
