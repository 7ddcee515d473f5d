#!/usr/bin/env bash
# bvhtoolbox: `bvh2csv --scale` multiplies positions once for every joint between them and the root.
#
# bvhtoolbox 0.1.3 scales the positions of a joint after it has added its parent, whose own are scaled already. So `bvh2csv -s 0.01`, the way from
# centimetres to metres that its help names, is right for the root only: the first child has 0.0001 times the position of the hips, the next one
# a millionth, and so on. A head that stands at 1.60 m comes out at 0.50 m here, below the hips. There is no message. A scale of 1 is right.
#
# Guessed before: every position times the scale.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvhtoolbox==0.1.3 transforms3d==0.4.2 numpy==2.4.6
cat > stand.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 50 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 20 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
0 90 0 0 0 0 0 0 0 0 0 0
0 90 0 0 0 0 0 0 0 0 0 0
BVH
mkdir plain scaled
# The command ends with the status 1 when it succeeds.
python/bin/bvh2csv -p -o plain stand.bvh > /dev/null || true
python/bin/bvh2csv -p -s 0.01 -o scaled stand.bvh > /dev/null || true
python/bin/python - <<'PYTHON'
import numpy as np

columns = ("Hips.y", "Chest.y", "Head.y")


def heights(folder):
    row = np.genfromtxt(f"{folder}/stand_pos.csv", delimiter=",", names=True, deletechars="")[0]
    return [float(row[name]) for name in columns]


plain, scaled = heights("plain"), heights("scaled")
for name, centimetres, metres in zip(columns, plain, scaled):
    print(f"{name}: {centimetres} cm is {metres} m")
assert plain == [90, 110, 160] and scaled == [0.9, 0.209, 0.50209]
PYTHON
