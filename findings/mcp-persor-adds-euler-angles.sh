#!/usr/bin/env bash
# mcp-persor: the "absolute" rotation of a joint is the sum of the Euler angles from the root, and its absolute position is NaN.
#
# get_joint_motion_df(joint, mode="absolute") of mcp-persor 1.0.6 adds the channels of the same name of all joints up to the root, whatever their
# order. For a BVH whose hips have angles (10, 20, 30) and whose spine has (40, 50, 60), it gives (50, 70, 90) for the spine; the true angles in the
# same order are others, 26 degrees off. A joint with positions below one without gets NaN. Writing with mode="absolute" sets angles in this way.
#
# Guessed before: the rotation and the place that the joints have in the world.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 pandas==2.2.3
python/bin/python -m pip install --quiet --no-compile --no-deps mcp-persor==1.0.6
cat > walk.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 20 5
      CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 7 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
1 90 2 10 20 30 40 50 60 0 20 5 0 0 0
1 90 2 10 20 30 40 50 60 0 20 5 0 0 0
BVH
python/bin/python - <<'PYTHON'
import numpy as np
from mcp_persor import BVHparser
from scipy.spatial.transform import Rotation

motion = BVHparser("walk.bvh")
turns = ["Zrotation", "Xrotation", "Yrotation"]
spine = motion.get_joint_motion_df("Spine", mode="absolute").iloc[0]
found = [float(spine[turn]) for turn in turns]
true = Rotation.from_euler("ZXY", [10, 20, 30], degrees=True) * Rotation.from_euler("ZXY", [40, 50, 60], degrees=True)
off = np.degrees((Rotation.from_euler("ZXY", found, degrees=True).inv() * true).magnitude())
print("spine in the world, z x y:", found, "true", true.as_euler("ZXY", degrees=True).round(1), f"which is {off:.1f} degrees off")
assert found == [50, 70, 90] and off > 20
head = motion.get_joint_motion_df("Head", mode="absolute").iloc[0]
places = [float(head[name]) for name in ("Xposition", "Yposition", "Zposition")]
print("head in the world:", places)
assert np.isnan(places).all()
PYTHON
