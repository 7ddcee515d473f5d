#!/usr/bin/env bash
# Joints of a BVH whose names have spaces (3ds Max Biped) are cut to their first word, and merged or lost.
#
# Biped exports joints as `Bip01 L Calf`. bvhio 1.5.4 names all of them `Bip01`. bvhTools 1.6.0 does too, keeps joints in a table by name, and so
# loses all but one: the skeleton has fewer joints than the file. bvh 0.3 finds a joint only by its first word. None says so.
#
# Guessed before: the whole line as the name, or an error at the second word.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet bvhio==1.5.4 bvhTools==1.6.0 bvh==0.3 numpy==2.4.6
python/bin/python - <<'PYTHON'
import contextlib
import io

import bvhio
from bvh import Bvh
from bvhTools.bvhIO import readBvh

text = """HIERARCHY
ROOT Bip01 Pelvis
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Bip01 L Thigh
  {
    OFFSET 10 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Bip01 L Calf
    {
      OFFSET 0 -40 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 -40 0
      }
    }
  }
}
MOTION
Frames: 1
Frame Time: 0.0333333
0 90 0 0 0 0 10 0 0 20 0 0
"""
with open("biped.bvh", "w") as file:
    file.write(text)
names = [joint.Name for joint, _, _ in bvhio.readAsHierarchy("biped.bvh").layout()]
with contextlib.redirect_stdout(io.StringIO()):
    kept = list(readBvh("biped.bvh").skeleton.joints)
print("bvhio", names, "bvhTools", kept)
assert names == ["Bip01"] * 3 and kept == ["Bip01", "Bip01_EndSite"]
file = Bvh(text)
assert file.joint_channels("Bip01")
try:
    file.joint_channels("Bip01 L Calf")
    raise SystemExit("bvh finds the whole name")
except LookupError as error:
    print("bvh", error)
PYTHON
