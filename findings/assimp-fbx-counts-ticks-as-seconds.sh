#!/usr/bin/env bash
# assimp: a motion that becomes an FBX is a hundred times too slow from BVH, and a thousand times from glTF.
#
# `assimp export` of assimp-utils 5.2.5~ds0-1+b1 (Debian) turns one format into another. Inside, times are counted in
# ticks: one frame of a BVH is a tick, and a millisecond of a glTF. Its FBX (as text) takes each tick as a second
# (46,186,158,000 units of FBX). So five frames at 100 per second, 40 ms long, last 4 s from the BVH and 40 s from a
# glTF of the same. As glTF the times are right. The first joint of the BVH is no object of the FBX: its curves hang
# on an object that is not there, and the walk stays at its place. Nothing is said.
#
# Guessed before: the FBX has the rate and the duration of the BVH, as the glTF has.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
[ "$(id -u)" != 0 ] || apt-get update -qq
apt-get download -qq assimp-utils=5.2.5~ds0-1+b1 libassimp5=5.2.5~ds0-1+b1 libdraco7=1.5.5+dfsg-2 libminizip1 2> apt.txt
for package in *.deb; do dpkg -x "$package" system; done
assimp() { LD_LIBRARY_PATH=$(echo "$folder"/system/usr/lib/*-linux-gnu) system/usr/bin/assimp "$@" > assimp.txt; }
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
Frames: 5
Frame Time: 0.01
0 90 0 0 0 0 0 0 0
1 90 0 0 0 0 0 10 0
2 90 0 0 0 0 0 20 0
3 90 0 0 0 0 0 30 0
4 90 0 0 0 0 0 40 0
BVH
assimp export walk.bvh walk.gltf
assimp export walk.bvh from-bvh.fbx -ffbxa
assimp export walk.gltf from-gltf.fbx -ffbxa
python3 - <<'PYTHON'
import json
import re

SECOND = 46_186_158_000


def seconds(name):
    """The times of all keys of an FBX in ASCII, as one set of lists."""
    with open(name) as file:
        keys = re.findall(r"KeyTime: \*\d+ \{\s*a: ([\d,]+)", file.read())
    return {tuple(int(key) / SECOND for key in text.split(",")) for text in keys}


with open("walk.gltf") as file:
    gltf = json.load(file)
(animation,) = gltf["animations"]
last = max(gltf["accessors"][sampler["input"]]["max"][0] for sampler in animation["samplers"])
print("last key of the glTF", round(last, 4), "s")
assert abs(last - 0.04) < 1e-6
for name, slower in (("from-bvh.fbx", 100), ("from-gltf.fbx", 1000)):
    times = max(seconds(name), key=len)
    print(name, "keys at", times, "s, right are 0 to 0.04")
    assert all(abs(time - slower * 0.01 * frame) < 1e-6 for frame, time in enumerate(times)) and len(times) == 5

    with open(name) as file:
        text = file.read()
    objects = set(re.findall(r"^\t\w+: (\d+), \"", text, re.MULTILINE))
    joints = re.findall(r'"Model::(\w+)", "LimbNode"', text)
    moved = re.findall(r'C: "OP", \d+, (\d+), "Lcl Translation"', text)
    print("joints", joints, "curves of a place for", moved, "of which are there", [id for id in moved if id in objects])
    assert joints == ["Knee", "EndSite_Knee"] and len(moved) == 2
    assert len([id for id in moved if id in objects]) == 1
PYTHON
