#!/usr/bin/env bash
# Errors of Pose2Sim and aniposelib, unmodified, in every place and with 2, 4 and 8 cameras, on the noise of
# `skiagraph sweep scenarios/sweeps/keypoints.toml --draws`: the rows of results/keypoints.md. Needs the environment that
# run.sh installs, or PYTHON. Prints a line of CSV for each: place,cameras,method,seed,mm. Takes some ten minutes.
#
# Usage: bash tests/pipelines/places.sh [path of skiagraph] [number of draws; default: 2]
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/release/skiagraph}")
draws=${2:-2}
python="${PYTHON:-$PWD/target/pipelines-python/bin/python}"
folder=$(mktemp -d -t skiagraph-places.XXXXXX)
trap 'rm -rf "$folder"' EXIT

# measure SET FILE PIPELINE: mean HumanEva error, mm
measure() {
  "$program" evaluate --quiet "$1" "$2" --from "$3" --json --out "$folder/measured" --force |
    "$python" -c 'import json, sys; print("%.2f" % json.load(sys.stdin)["metrics"]["humaneva_mm"]["mean"])'
}

for place in studio gym outdoors; do
  for cameras in 2 4 8; do
    for ((seed = 0; seed < draws; seed++)); do
      rm -rf "$folder"/*
      "$program" render --quiet scenarios/walk.toml motion.loop_to_s=2.5 observation.preset=$place rig.ring.count=$cameras \
        observation.seed=$seed --key default --out "$folder/set" >/dev/null
      "$program" export --quiet "$folder/set" --to pose2sim,anipose --out "$folder" >/dev/null
      (cd "$folder/pose2sim" &&
        "$python" -c 'from Pose2Sim import Pose2Sim; Pose2Sim.triangulation(); Pose2Sim.filtering()' >log.txt 2>&1) || true
      (cd "$folder/anipose" && sed -n 's/^    \([a-zA-Z]\)/\1/p' README.txt >triangulate.py && "$python" triangulate.py &&
        sed 's/found = .*/found = rig.triangulate_optim(data["points"])/; s/found.npz/optimised.npz/' triangulate.py >optimise.py &&
        "$python" optimise.py >log.txt 2>&1) || true
      row() { if [ -f "$2" ]; then echo "$place,$cameras,$1,$seed,$(measure "$folder/set" "$2" "$3")"; fi; }
      for file in "$folder"/pose2sim/pose-3d/*.trc; do
        case "$file" in *_filt_*) row "Pose2Sim filtered" "$file" pose2sim ;; *) row Pose2Sim "$file" pose2sim ;; esac
      done
      row aniposelib "$folder/anipose/found.npz" anipose
      row "aniposelib optimised" "$folder/anipose/optimised.npz" anipose
    done
  done
done
