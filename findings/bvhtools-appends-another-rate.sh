#!/usr/bin/env bash
# bvhTools: a motion of 50 frames per second that is appended to one of 100 plays at double speed, and one of another rotation order is bent.
#
# `appendBvhSlices` of bvhTools 1.6.0 puts the rows of numbers of the second motion under those of the first. It looks neither at the frame time nor
# at the order of the channels. Two files of the same skeleton may well differ in both. Ten seconds become five, and a turn about y becomes one about
# z where one file has z, x, y and the other y, x, z. Nothing is said. Files of one rate and one order are right.
#
# Guessed before: the motion is converted, or refused.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvhTools==1.6.0 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
python/bin/python - <<'PYTHON'
import numpy
from bvhTools.bvhIO import readBvh
from bvhTools.bvhSlicer import appendBvhSlices


def motion(rate, order, seconds):
    rotations = " ".join(f"{axis}rotation" for axis in order)
    turned = " ".join("90" if axis == "Y" else "0" for axis in order)
    frames = rate * seconds
    with open(f"{rate}{order}.bvh", "w") as file:
        file.write(f"""HIERARCHY
ROOT Hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition {rotations}
  JOINT Foot
  {{
    OFFSET 10 -90 0
    CHANNELS 3 {rotations}
    End Site
    {{
      OFFSET 0 0 20
    }}
  }}
}}
MOTION
Frames: {frames}
Frame Time: {1 / rate}
""")
        file.writelines(f"{100 * frame / rate:.4f} 90 0 {turned} 0 0 0\n" for frame in range(frames))
    return readBvh(f"{rate}{order}.bvh")


def foot(bvh, frame):
    place = bvh.getFKAtFrame(frame)["Foot"]
    return numpy.round(place[1] if isinstance(place, tuple) else place, 3)


both = appendBvhSlices(motion(100, "ZXY", 2), [motion(50, "ZXY", 10)])
seconds = (both.motion.numFrames - 200) * both.motion.frameTime
speed = (both.motion.frames[400][0] - both.motion.frames[300][0]) / (100 * both.motion.frameTime)
print(f"ten seconds became {seconds:g}, 100 cm/s became {speed:g}")
assert round(seconds, 6) == 5 and round(speed, 3) == 200

other = motion(100, "YXZ", 2)
both = appendBvhSlices(motion(100, "ZXY", 2), [other])
print("the foot in the first frame:", foot(other, 0), "; appended:", foot(both, 200))
assert numpy.allclose(foot(other, 0), [0, 0, -10]) and numpy.allclose(foot(both, 200), [90, 100, 0])
PYTHON
