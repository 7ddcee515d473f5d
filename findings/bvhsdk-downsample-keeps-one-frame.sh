#!/usr/bin/env bash
# bvhsdk: `downSample` from 120 to 30 frames per second leaves one frame, and from 60 to 24 slows the motion down.
#
# bvhsdk 0.2.1 rounds total frames / surplus frames to a whole step, and removes every frame at that step. Where three of four frames have to
# go, the step is 1: all but the first are removed. This is the example of its own documentation. From 60 to 24 the step is 2: 30 frames of
# each second are left, and are said to be at 24, so that ten seconds last 12.5. It returns True. Halving the rate is right.
#
# Guessed before: every fourth frame, and an error or the nearest frames where the rates do not divide.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvhsdk==0.2.1 numpy==2.4.6 matplotlib==3.11.2
python/bin/python - <<'PYTHON'
import bvhsdk

head = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {
    OFFSET 0 20 0
  }
}
MOTION
"""


def after(rate, target):
    frames = 10 * rate
    with open("walk.bvh", "w") as file:
        file.write(f"{head}Frames: {frames}\nFrame Time: {1 / rate:.7f}\n")
        file.writelines(f"{frame} 90 0 0 0 0\n" for frame in range(frames))
    motion = bvhsdk.ReadFile("walk.bvh")
    assert motion.frames == frames and motion.downSample(target)
    seconds = motion.frames * motion.frametime
    print(f"{rate} to {target}: {frames} frames became {motion.frames}, 10 s became {seconds:.2f} s")
    return motion.frames, round(seconds, 2)


assert after(120, 60) == (600, 10)
assert after(120, 30) == (1, 0.03)
assert after(60, 24) == (300, 12.5)
PYTHON
