#!/usr/bin/env bash
# Kinetics Toolkit: the frame rate in a TRC file is the true one times the number of frames.
#
# write_trc_file of kineticstoolkit 0.17.0 divides the number of frames by the time between the first two. 100 Hz become 5000 Hz with 50 frames,
# and 100,000 Hz with 1000 frames, as DataRate, CameraRate and OrigDataRate. The column of times is right. Where a marker is missing it says
# nan: the function fills gaps first, but drops what that returns. Other programs that read TRC files take the rate from the head.
#
# Guessed before: 100, and empty fields for a missing marker.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.4.6 pandas==2.3.3 scipy==1.17.1 matplotlib==3.11.2 limitedinteraction==1.0 \
    tqdm==4.70.1 scikit-learn==1.9.1 ezc3d==1.7.2 requests==2.34.2 requests-cache==1.3.3
python/bin/python -m pip install --quiet --no-compile --no-deps kineticstoolkit==0.17.0
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import numpy as np
import kineticstoolkit as ktk


def written(frames):
    markers = ktk.TimeSeries(time=np.arange(frames) / 100)
    place = np.column_stack([np.arange(frames) / 100, np.ones(frames), np.full(frames, 0.5), np.ones(frames)])
    markers.data["Ankle"] = place.copy()
    markers.data["Knee"] = place.copy()
    markers.data["Knee"][20:25] = np.nan
    ktk.kinematics.write_trc_file(markers, "walk.trc")
    with open("walk.trc") as file:
        lines = file.read().splitlines()
    head = dict(zip(lines[1].split("\t"), lines[2].split("\t")))
    rows = [line.split("\t") for line in lines[3:] if line[:1].isdigit()]
    return float(head["DataRate"]), 1 / (float(rows[1][1]) - float(rows[0][1])), rows[20][5]


found = {frames: written(frames) for frames in (50, 1000)}
for frames, (rate, true, gap) in found.items():
    print(f"{frames} frames at 100 Hz: DataRate {rate:g}, by the times {true:g}; a missing marker is {gap!r}")
assert [round(value[0]) for value in found.values()] == [5000, 100_000]
assert [round(value[1]) for value in found.values()] == [100, 100]
PYTHON
