#!/usr/bin/env bash
# Pipelines of keypoints that people use, unmodified, on exports as they are: Pose2Sim, aniposelib, Caliscope. From perfect keypoints
# each must return the truth to a millimetre, and its files must be read as it writes them.
#
# Usage: bash tests/pipelines/run.sh [path of skiagraph] [SET with perfect keypoints; default: walk.toml and lens.toml, rendered]
# Installs the pipelines into target/pipelines-python, once; if it cannot, it prints SKIPPED and succeeds (with CI=true it fails). Then it
# takes a minute.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/debug/skiagraph}")
python="$PWD/target/pipelines-python/bin/python"

skip() {
  echo "SKIPPED: tests/pipelines/run.sh: $1" >&2
  if [ -n "${SKIAGRAPH_SKIPPED:-}" ]; then echo "tests/pipelines/run.sh: $1" >> "$SKIAGRAPH_SKIPPED"; fi
  if [ "${CI:-}" = true ]; then exit 1; else exit 0; fi
}

# without their own dependencies, which include PyTorch and Qt: triangulation and filtering need only these
if ! "$python" -c 'import aniposelib.cameras, caliscope.api, Pose2Sim.triangulation, Pose2Sim.filtering' 2>/dev/null; then
  { python3 -m venv target/pipelines-python &&
    "$python" -m pip install --quiet numpy scipy pandas toml rtoml tqdm anytree c3d filterpy statsmodels matplotlib numba jax \
      av rich platformdirs opencv-python-headless &&
    "$python" -m pip install --quiet --no-deps pose2sim==0.10.49 aniposelib==0.8.0 caliscope==0.11.8; } ||
    skip "the pipelines cannot be installed"
fi

folder=$(mktemp -d -t skiagraph-pipelines.XXXXXX)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/sets" "$folder/exports"
sets=("${@:2:1}")
if [ $# -lt 2 ]; then
  for scenario in walk lens; do
    "$program" render --quiet "tests/pipelines/$scenario.toml" --out "$folder/sets/$scenario"
    sets+=("$folder/sets/$scenario")
  done
fi

# measure SET FILE PIPELINE MOST_MM LOST_FRAMES
measure() {
  local set=$1
  shift
  "$program" evaluate --quiet "$set" "$1" --from "$2" --json --out "$folder/measured" --force >"$folder/run.json"
  "$python" - "$folder/run.json" "$1" "$3" "$4" <<'PYTHON'
import json, pathlib, sys

run, file, most, lost = sys.argv[1:]
run, file = pathlib.Path(run), pathlib.Path(file)
name = file.relative_to(run.parent / "exports")
run = json.loads(run.read_text())
of = lambda name: run["metrics"][name]["mean"]
# frame 0, the start pose, is not measured
found, missing = of("humaneva_mm"), round(of("lost_frames") * (run["frames"] - 1))
print(f"{name}: {found:.3f} mm, {missing} frames lost")
assert found <= float(most), f"expected at most {most} mm"
assert missing == int(lost), f"expected {lost} lost frames"
assert not run.get("hint"), run["hint"]
PYTHON
}

for set in "${sets[@]}"; do
  exports="$folder/exports/$(basename "$set")"
  "$program" export --quiet "$set" --to pose2sim,anipose,caliscope --out "$exports" >/dev/null
  # the commands of the exports' README.txt
  (cd "$exports/pose2sim" &&
    "$python" -c 'from Pose2Sim import Pose2Sim; Pose2Sim.triangulation(); Pose2Sim.filtering()' >log.txt 2>&1) ||
    { tail -20 "$exports/pose2sim/log.txt" >&2; exit 1; }
  for pipeline in anipose caliscope; do
    (cd "$exports/$pipeline" && sed -n 's/^    \([a-zA-Z]\)/\1/p' README.txt >triangulate.py && "$python" triangulate.py)
  done
  for file in "$exports"/pose2sim/pose-3d/*.trc "$exports"/pose2sim/pose-3d/*.c3d; do
    # a filter smooths, and Pose2Sim's leaves out the last frame
    case "$file" in
      *_filt_*) measure "$set" "$file" pose2sim 5 1 ;;
      *) measure "$set" "$file" pose2sim 1 0 ;;
    esac
  done
  for pipeline in anipose caliscope; do
    measure "$set" "$exports/$pipeline/found.npz" anipose 1 0
  done
done

# the shares of faults that the page of the presets states are those of this program
"$python" tests/pipelines/places_shares.py "$program" --check
