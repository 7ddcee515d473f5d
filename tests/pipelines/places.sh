#!/usr/bin/env bash
# Errors of Pose2Sim and aniposelib, unmodified, on the sets of the sweeps scenarios/sweeps/keypoints.toml and keypoint-costs.toml with
# --draws, whose draws are observation.seed 1, 2 and so on: their rows of results/keypoints.md. Needs the environment that run.sh
# installs, or PYTHON. Prints a line for each: condition;method;draw;mm. A draw takes some ten minutes.
#
# Usage: bash tests/pipelines/places.sh [path of skiagraph] [number of draws; default: 2] >places.csv
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/release/skiagraph}")
draws=${2:-2}
python="${PYTHON:-$PWD/target/pipelines-python/bin/python}"
folder=$(mktemp -d -t skiagraph-places.XXXXXX)
trap 'rm -rf "$folder"' EXIT

# mean HumanEva error of FILE, mm, read as PIPELINE writes it; nothing without the file
row() {
  [ -f "$3" ] || return 0
  "$program" evaluate --quiet "$folder/set" "$3" --from "$4" --json --out "$folder/measured" --force >"$folder/run.json"
  echo "$1;$2;$draw;$("$python" -c 'import json, sys; print("%.2f" % json.load(sys.stdin)["metrics"]["humaneva_mm"]["mean"])' \
    <"$folder/run.json")"
}

# pipelines CONDITION KEY=VALUE...
pipelines() {
  local condition=$1
  shift
  for ((draw = 1; draw <= draws; draw++)); do
    rm -rf "${folder:?}"/*
    "$program" render --quiet scenarios/walk.toml motion.loop_to_s=2.5 "$@" observation.seed=$draw --key default \
      --out "$folder/set" >/dev/null
    "$program" export --quiet "$folder/set" --to pose2sim,anipose --out "$folder" >/dev/null
    # a pipeline that fails has no row
    (cd "$folder/pose2sim" &&
      "$python" -c 'from Pose2Sim import Pose2Sim; Pose2Sim.triangulation(); Pose2Sim.filtering()' >log.txt 2>&1) || true
    (cd "$folder/anipose" && sed -n 's/^    \([a-zA-Z]\)/\1/p' README.txt >triangulate.py && "$python" triangulate.py &&
      sed 's/found = .*/found = rig.triangulate_optim(data["points"])/; s/found.npz/optimised.npz/' triangulate.py >optimise.py &&
      "$python" optimise.py >log.txt 2>&1) || true
    for file in "$folder"/pose2sim/pose-3d/*.trc; do
      case "$file" in
        *_filt_*) row "$condition" "Pose2Sim, filtered" "$file" pose2sim ;;
        *) row "$condition" Pose2Sim "$file" pose2sim ;;
      esac
    done
    row "$condition" aniposelib "$folder/anipose/found.npz" anipose
    row "$condition" "aniposelib, optimised" "$folder/anipose/optimised.npz" anipose
  done
}

pipelines "studio, 4 cameras" observation.preset=studio
pipelines "gym, 2 cameras" observation.preset=gym rig.ring.count=2
pipelines "gym, 4 cameras" observation.preset=gym
pipelines "gym, 8 cameras" observation.preset=gym rig.ring.count=8
pipelines "outdoors, 4 cameras" observation.preset=outdoors
common=(observation.keypoints.layout=halpe26 observation.silhouette=corrupted)
pipelines exact "${common[@]}"
pipelines "keypoints 1 % (2 px)" "${common[@]}" observation.keypoints.slow_percent=1.0
pipelines "definition 14 mm" "${common[@]}" observation.keypoints.bias_mm=14.0
pipelines "clocks 10 ms" "${common[@]}" observation.corruption.desynchronisation_ms=10.0
pipelines "cameras 0.5 degrees" "${common[@]}" observation.corruption.calibration_deg=0.5
first_trial=(observation.keypoints.layout=halpe26 motion.loop_to_s=5 observation.keypoints.white_percent=0.75
  observation.keypoints.slow_percent=0.75 observation.keypoints.slow_s=0.15 observation.keypoints.occluded_error=1.0
  observation.keypoints.missing=0.005 observation.keypoints.occluded_rate=15.0 observation.keypoints.inversion=0.0009
  observation.keypoints.stretch_s=0.15 observation.keypoints.confidence_noise=0.3)
pipelines "first trial, without definition" "${first_trial[@]}"
pipelines "first trial, knees" "${first_trial[@]}" observation.keypoints.bias_mm=9.8
pipelines "first trial, hips" "${first_trial[@]}" observation.keypoints.bias_mm=12.3
