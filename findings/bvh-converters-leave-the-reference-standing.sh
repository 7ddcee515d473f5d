#!/usr/bin/env bash
# Two converters of BVH to CSV drop position channels below the root: a body that walks below a reference joint stands still.
#
# In BVH any joint may have position channels. Exports with a reference joint at the root have the walk in the positions of the hips below it.
# bvh-converter 1.0.2 and bvhtoolbox 0.1.3 read these channels, and use the fixed offset instead, without a message: here the hips walk 3 m along
# x and both tables keep them at 0. bvhio 1.5.4 follows the channels.
#
# Guessed before: the channels in place of the offset, or added to it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvh-converter==1.0.2 bvhtoolbox==0.1.3 bvhio==1.5.4 transforms3d==0.4.2 numpy==2.4.6
cat > walk.bvh <<'BVH'
HIERARCHY
ROOT Reference
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Hips
  {
    OFFSET 0 90 0
    CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
0 0 0 0 0 0 0 90 0 0 0 0
0 0 0 0 0 0 300 85 0 0 0 0
BVH
python/bin/bvh-converter walk.bvh > /dev/null
mv walk_worldpos.csv converter.csv
python/bin/bvh2csv -p walk.bvh > /dev/null || true  # it ends with the status 1 when it succeeds
mv walk_pos.csv toolbox.csv
python/bin/python - <<'PYTHON'
import csv

import bvhio

found = {}
for tool in ("converter", "toolbox"):
    with open(f"{tool}.csv") as file:
        last = list(csv.DictReader(file))[-1]
    found[tool] = [float(value) for name, value in last.items() if name.lower() in ("hips.x", "hips.y", "hips.z")]
hips = bvhio.readAsHierarchy("walk.bvh").loadPose(1).Children[0].PositionWorld
found["bvhio"] = [hips.x, hips.y, hips.z]
print("hips in the last frame:", found)
assert found == {"converter": [0, 90, 0], "toolbox": [0, 90, 0], "bvhio": [300, 85, 0]}, found
PYTHON
