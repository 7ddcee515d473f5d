#!/usr/bin/env bash
# sqzc3d: a part of a C3D file has the markers of that part, and the forces of the start of the file.
#
# `read` of sqzc3d 0.4.0 takes `start_frame` and `frame_count`. Markers are those of the frames that were asked for.
# The analog channels have the right number of samples, and these always begin with the first sample of the file. So
# the second of the markers in which a foot lands has the forces of a second long before it. Everything says that it is
# valid. The whole file at once is right, and the samples can be cut out by hand.
#
# Guessed before: the markers and the analog samples that ezc3d reads.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6
python/bin/python -m pip install --quiet --no-compile ezc3d==1.7.2 sqzc3d==0.4.0
python/bin/python - <<'PYTHON'
import ezc3d
import numpy as np
import sqzc3d

RATE, PER_FRAME, FRAMES = 100, 10, 500
# A foot that comes down: its height falls to 0 at 3 s, and the force is there from then on.
times, samples = np.arange(FRAMES) / RATE, np.arange(FRAMES * PER_FRAME) / RATE / PER_FRAME
heights, forces = np.maximum(0, 300 - 100 * times), np.where(samples >= 3, 700.0, 0.0)

file = ezc3d.c3d()
points = np.ones((4, 1, FRAMES))
points[:3, 0] = 0
points[2, 0] = heights
file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
file["parameters"]["POINT"]["LABELS"]["value"] = ["HEEL"]
file["parameters"]["ANALOG"]["RATE"]["value"] = [RATE * PER_FRAME]
file["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fz"]
file["data"]["points"] = points
file["data"]["analogs"] = forces[None, None]
file.write("landing.c3d")
read = ezc3d.c3d("landing.c3d")["data"]
assert np.allclose(read["points"][2, 0], heights, atol=1e-4) and np.allclose(read["analogs"][0, 0], forces)

whole = sqzc3d.read("landing.c3d")
assert np.allclose(whole.points[:, 0, 2], heights, atol=1e-4) and np.allclose(whole.analog["Fz"], forces)
for start, count in ((0, 500), (300, 100), (250, 100), (400, 50)):
    part = sqzc3d.read("landing.c3d", start_frame=start, frame_count=count)
    height, force = part.points[:, 0, 2], part.analog["Fz"]
    right = forces[start * PER_FRAME : (start + count) * PER_FRAME]
    print(f"frames {start} to {start + count}: {height[0]:.0f} to {height[-1]:.0f} mm,", end=" ")
    print(f"mean force {force.mean():.0f} N in {len(force)} samples, right {right.mean():.0f} N")
    assert np.allclose(height, heights[start : start + count], atol=1e-4) and len(force) == len(right)
    assert np.allclose(force, forces[: len(force)]) and np.asarray(part.analogs_valid).all()
    assert start == 0 or not np.allclose(force, right)
PYTHON
