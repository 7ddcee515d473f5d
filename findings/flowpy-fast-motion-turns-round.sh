#!/usr/bin/env bash
# flowpy: in the PNG of KITTI a motion of 600 pixels is written as one of 424 pixels the other way, as a valid one.
#
# The PNG of KITTI holds optical flow in steps of 1/64 pixel, from -512 to less than 512. `flow_write` of flowpy 0.6.0
# takes any flow, and what is larger comes round at the other end: 512 is -512, 600 is -424, and -600 is 424. The mark
# of valid pixels is set, so a tracker that is right is 1024 pixels off there. Nothing is said. In a close view
# with 0.5 mm to a pixel, at 25 frames per second, a foot that swings at 8 m/s passes 640 pixels a frame. Smaller
# motions and gaps come back, and `.flo` files hold all.
#
# Guessed before: what is written comes back within 1/64 pixel.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.23.5 scipy==1.10.1 matplotlib==3.7.5 pypng==0.20220715.0
python/bin/python -m pip install --quiet --no-compile --no-deps flowpy==0.6.0
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import flowpy
import numpy as np
import png

flow = np.zeros((1, 8, 2), np.float32)
flow[0, :, 0] = [0, 511.5, 512, 600, -512, -600, 1200, np.nan]
flow[0, 7, 1] = np.nan
flowpy.flow_write("flow.flo", flow)
assert np.array_equal(flowpy.flow_read("flow.flo"), flow, equal_nan=True)

flowpy.flow_write("flow.png", flow)
back = flowpy.flow_read("flow.png")[0, :, 0]
# By hand, from the 16-bit numbers of the file: red is 64 times the motion plus 32,768, blue is 1 where it is valid.
_, _, rows, _ = png.Reader("flow.png").read()
pixels = np.array(list(rows), int).reshape(8, 3)
by_hand = np.where(pixels[:, 2] > 0, (pixels[:, 0] - 32768) / 64, np.nan)
for motion, found, valid in zip(flow[0, :, 0], back, pixels[:, 2]):
    print(f"{motion} pixels come back as {found}, valid {valid}")
assert np.array_equal(back, by_hand, equal_nan=True)
assert np.array_equal(back, [0, 511.5, -512, -424, -512, 424, 176, np.nan], equal_nan=True)
assert pixels[:, 2].tolist() == [1] * 7 + [0]
PYTHON
