#!/usr/bin/env bash
# myogait: a TRC file in millimetres has numbers of metres, and in any TRC file the body stands on its head.
#
# `export_trc` of myogait 0.9.2 takes units of "m" or "mm". The head of the file says what was asked for; the numbers
# are the same in both, metres. A program that believes the head sees a body of 1.4 mm. Both have y as the image has
# it, downward from the top edge, where TRC files for OpenSim have y up: shoulders at 0.63, hips at 1.17, ankles at
# 2.01. Nothing is said.
#
# Guessed before: the numbers in the unit of the head of the file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 pandas==2.2.3 matplotlib==3.10.3 \
    opencv-python-headless==4.12.0.88
python/bin/python -m pip install --quiet --no-compile --no-deps gaitkit==1.5.0 myogait==0.9.2
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import numpy as np
from myogait import export_trc

width, height = 1920, 1080
# A person in the image, in pixels from its top left corner: 860 pixels from the nose to the ankles.
body = {"NOSE": (960, 100), "LEFT_ANKLE": (945, 960), "RIGHT_ANKLE": (975, 960)}
body |= {"LEFT_SHOULDER": (940, 300), "RIGHT_SHOULDER": (980, 300), "LEFT_HIP": (945, 560), "RIGHT_HIP": (975, 560)}
frames = [
    {
        "frame_idx": frame,
        "confidence": 1.0,
        "landmarks": {name: {"x": x / width, "y": y / height, "visibility": 1.0} for name, (x, y) in body.items()},
    }
    for frame in range(3)
]
data = {"meta": {"fps": 50.0, "width": width, "height": height}, "subject": {"height_m": 1.8}, "frames": frames}
names = ["LEFT_SHOULDER", "LEFT_HIP", "LEFT_ANKLE"]

found = {}
for unit in ("m", "mm"):
    export_trc(data, "walk.trc", marker_names=names, units=unit)
    lines = open("walk.trc").read().splitlines()
    head = dict(zip(lines[1].split("\t"), lines[2].split("\t")))
    assert head["Units"] == unit and head["DataRate"] == "50.00"
    row = [line for line in lines if line.startswith("1\t")][0]
    found[unit] = np.array(row.split("\t")[2:], float).reshape(3, 3)
    print(f"Units {head['Units']}: y of shoulder, hip and ankle {found[unit][:, 1]}")

metres = 1.8 / 860
shoulder_to_ankle = (960 - 300) * metres
assert abs(shoulder_to_ankle - 1.381) < 0.001
assert np.array_equal(found["m"], found["mm"])
assert np.allclose(found["mm"][:, 1], np.array([300, 560, 960]) * metres, atol=1e-5)
# Up in the room is y in a TRC file: the ankle is above the shoulder.
assert found["m"][2, 1] - found["m"][0, 1] > 1.38
PYTHON
