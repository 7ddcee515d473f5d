#!/usr/bin/env bash
# movement leaves out the frame numbers of DeepLabCut and Anipose tables, and so moves everything after a gap to earlier times.
#
# The first column of a DeepLabCut table and `fnum` of an Anipose table are numbers of frames. movement 0.15.0 counts rows instead: rows 3, 4 and
# 8, as of a part of a video with bad frames taken out, come back at the frames 0, 1 and 2, and it calls the unit frames. Speeds over the gap
# are too high, and two cameras no longer fit together. There is no warning.
#
# Guessed before: the numbers as times, or the missing rows as NaN.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet movement==0.15.0
python/bin/python - <<'PYTHON'
import pathlib

import numpy as np
from loguru import logger
from movement.io import load_dataset
from movement.kinematics import compute_velocity

logger.disable("movement")
frames = [3, 4, 8]
# A nose that goes one pixel a frame, as DeepLabCut writes it.
lines = ["scorer,net,net,net", "bodyparts,nose,nose,nose", "coords,x,y,likelihood"]
pathlib.Path("nose.csv").write_text("\n".join(lines + [f"{frame},{frame},0,0.9" for frame in frames]) + "\n")
# The same in space, as Anipose writes it.
names = ["nose_x", "nose_y", "nose_z", "nose_error", "nose_score", "nose_ncams"]
names += [f"M_{row}{column}" for row in range(3) for column in range(3)] + [f"center_{row}" for row in range(3)] + ["fnum"]
rows = [[frame, 0, 0, 0.1, 0.9, 3, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, frame] for frame in frames]
pathlib.Path("nose_3d.csv").write_text("\n".join([",".join(names)] + [",".join(map(str, row)) for row in rows]) + "\n")

for path, program in (("nose.csv", "DeepLabCut"), ("nose_3d.csv", "Anipose")):
    found = load_dataset(path, source_software=program)
    speed = compute_velocity(found.position).sel(space="x").values.ravel()
    print(program, "frames", frames, "come back as", found.time.values, "x", found.position.sel(space="x").values.ravel(), "speed", speed)
    assert found.time.values.tolist() == [0, 1, 2] and found.time_unit == "frames"
    assert np.allclose(speed, [1, 2.5, 4]), speed
PYTHON
