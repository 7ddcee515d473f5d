#!/usr/bin/env bash
# bvhio: a BVH that is read and written again has other end sites: toes reach through the floor, and a head is 3 cm high.
#
# bvhio 1.5.4 reads a file into joints (`readAsHierarchy`), which have no end sites. When it writes them it gives each last joint an end of its own:
# 0.3 of the bone before it, and in the direction of that bone. Toes of 7 cm along the floor become 4.6 cm, and their tips are 1.8 cm below the ball
# of the foot, as the bone from the ankle to the ball goes down. A head of 20 cm on a neck of 10 cm becomes 3 cm. Nothing is said. Joints and their
# motion are right, and `readAsBvh` has the ends of the file.
#
# Guessed before: the same offsets.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvhio==1.5.4 spatial-transform==1.3.3 PyGLM==2.8.2 numpy==2.4.6
cat > before.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Neck
  {
    OFFSET 0 50 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 10 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 20 0
      }
    }
  }
  JOINT Foot
  {
    OFFSET 10 -84 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Toes
    {
      OFFSET 0 -6 14
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 0 7
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
0 90 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0
1 90 0 0 0 0 0 5 0 0 5 0 0 10 0 0 10 0
BVH
python/bin/python - <<'PYTHON'
import bvhio


def ends(path):
    container = bvhio.readAsBvh(path)
    found = {}
    for joint, *_ in container.Root.layout():
        if not joint.Children:
            found[joint.Name] = [round(value, 3) + 0 for value in joint.EndSite]
    return found


bvhio.writeHierarchy("after.bvh", bvhio.readAsHierarchy("before.bvh"), 0.01)
before, after = ends("before.bvh"), ends("after.bvh")
print("end sites before:", before, "and after:", after)
assert before == {"Head": [0, 20, 0], "Toes": [0, 0, 7]}
assert after == {"Head": [0, 3, 0], "Toes": [0, -1.8, 4.2]}
PYTHON
