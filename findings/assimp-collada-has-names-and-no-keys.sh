#!/usr/bin/env bash
# assimp: a motion that becomes a COLLADA file has samplers without any keys, and the file cannot be read again.
#
# `assimp export` of assimp-utils 5.2.5~ds0-1+b1 (Debian) writes an animation with a sampler and a channel for each
# joint of a BVH. The samplers name their times, matrices and interpolations (`#Hips_matrix-input` and so on), and
# nothing in the file has these names: all keys of the motion are left out. The program says that it wrote the file,
# and reading this file by the same program is an error. A glTF of the same BVH has the keys; a COLLADA file that is
# made from that glTF has none again.
#
# Guessed before: a COLLADA file has the keys that the glTF has.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
[ "$(id -u)" != 0 ] || apt-get update -qq
apt-get download -qq assimp-utils=5.2.5~ds0-1+b1 libassimp5=5.2.5~ds0-1+b1 libdraco7=1.5.5+dfsg-2 libminizip1 2> apt.txt
for package in *.deb; do dpkg -x "$package" system; done
assimp() { LD_LIBRARY_PATH=$(echo "$folder"/system/usr/lib/*-linux-gnu) system/usr/bin/assimp "$@"; }
cat > walk.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.01
0 90 0 0 0 0 0 0 0
1 90 0 0 0 0 0 10 0
2 90 0 0 0 0 0 20 0
BVH
assimp export walk.bvh walk.gltf > /dev/null
for source in walk.bvh walk.gltf; do
  assimp export $source walk.dae | tail -1
  python3 - <<'PYTHON'
import json
import xml.etree.ElementTree as tree

with open("walk.gltf") as file:
    gltf = json.load(file)
keys = max(gltf["accessors"][sampler["input"]]["count"] for sampler in gltf["animations"][0]["samplers"])
space = "{http://www.collada.org/2005/11/COLLADASchema}"
document = tree.parse("walk.dae").getroot()
there = {element.get("id") for element in document.iter() if element.get("id")}
samplers = list(document.iter(space + "sampler"))
wanted = [row.get("source")[1:] for sampler in samplers if sampler.get("id") for row in sampler.iter(space + "input")]
missing = [name for name in wanted if name not in there]
print("keys in the glTF", keys, "- of", len(wanted), "sources", len(missing), "are not in the COLLADA file:", missing[0])
assert keys == 3 and len(wanted) == 6 and missing == wanted
PYTHON
  if assimp export walk.dae again.gltf > again.txt; then exit 1; fi
  tail -1 again.txt
  grep -q 'Unable to resolve library reference "Hips_matrix-input"' again.txt
done
