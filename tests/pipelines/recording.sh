#!/usr/bin/env bash
# A recording of a real person, from the demonstration in the Python package pose2sim to the estimate over the masks, by at most five
# commands; nothing of it is in this repository. It asserts the overlap that docs/recordings.md states.
#
# Usage: bash tests/pipelines/recording.sh [path of skiagraph]
# By hand, not in .ci/run: it installs some 700 MB into target/recording-python, once, and takes about five minutes.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/release/skiagraph}")
python="$PWD/target/recording-python/bin/python"

if ! "$python" -c 'import mediapipe, Pose2Sim' 2>/dev/null; then
  python3 -m venv target/recording-python
  "$python" -m pip install --quiet mediapipe==0.10.21
  "$python" -m pip install --quiet --no-deps pose2sim==0.10.49
fi
demo=$("$python" -c 'import importlib.util as u; print(*u.find_spec("Pose2Sim").submodule_search_locations)')/Demo_SinglePerson

folder=$(mktemp -d -t skiagraph-recording.XXXXXX)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/balance.toml" <<TOML
schema = "skiagraph.recording/1"
name = "balance"
frames_per_second = 60
reduce = 4
rig.file = [{ path = "$demo/calibration/Calib.qca.txt" }]
masks = { path = "masks", fit = "letterboxed" }
keypoints = { path = "keypoints.npz" }
TOML

"$python" tests/pipelines/recording_masks.py "$demo/videos" "$folder" 2>"$folder/mediapipe.log"
"$program" import "$folder/balance.toml" --out "$folder/set"
"$program" track "$folder/set" --tracker annealed_particle_filter --out "$folder/run"
"$program" evaluate "$folder/set" "$folder/run" | tee "$folder/table.txt"

"$python" - "$folder/run/run.json" "$folder/table.txt" <<'PYTHON'
import json, re, sys

run, table = json.load(open(sys.argv[1])), open(sys.argv[2]).read()
mean = run["metrics"]["silhouette_iou"]["mean"]
worst = float(re.search(r"worst image: overlap ([0-9.]+)", table)[1])
print(f"overlap {mean:.3f}, worst image {worst:.3f}")
assert mean >= 0.88, "expected an overlap of 0.88 in the mean"
assert worst >= 0.80, "expected an overlap of 0.80 in the worst image"
assert "grade" not in run["verdict"], "a recording has no grade"
PYTHON
