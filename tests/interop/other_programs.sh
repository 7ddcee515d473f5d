#!/usr/bin/env bash
# The tested rows of docs/other-programs.md: what other programs, unmodified, do to files like ours.
#
# Usage: bash tests/interop/other_programs.sh [path of skiagraph] [ROW ...]
# Installs the programs into target/other-programs and target/pipelines-python, once; if it cannot, it prints SKIPPED and succeeds (with
# CI=true it fails). Then it takes a minute.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/debug/skiagraph}")
shift || true
folder="$PWD/target/other-programs"

skip() {
  echo "SKIPPED: tests/interop/other_programs.sh: $1" >&2
  if [ -n "${SKIAGRAPH_SKIPPED:-}" ]; then echo "tests/interop/other_programs.sh: $1" >> "$SKIAGRAPH_SKIPPED"; fi
  if [ "${CI:-}" = true ]; then exit 1; else exit 0; fi
}

packages="numpy opencv-python-headless==5.0.0.93 OpenImageIO==3.2.2.0 OpenEXR==3.5.3 Pillow==13.0.0 webdataset==1.0.2 sleap-io==0.9.5
  pycocotools==2.0.11 evo==1.38.1 bvhTools==1.6.0 mujoco==4.0.0 pybullet==3.2.7 pin==4.1.0 yourdfpy==0.0.60 urchin==0.0.30"
if [ ! -e "$folder/complete" ]; then
  python3 -m venv "$folder/python" && "$folder/python/bin/python" -m pip install --quiet $packages || skip "the programs cannot be installed"
  if command -v npm >/dev/null; then
    npm install --silent --no-audit --no-fund --prefix "$folder/node" three@0.187.0 >/dev/null || skip "three cannot be installed"
  fi
  touch "$folder/complete"
fi
export SKIAGRAPH_THREE="$folder/node"

work=$(mktemp -d -t skiagraph-programs.XXXXXX)
trap 'rm -rf "$work"' EXIT
cat >"$work/scenario.toml" <<'SCENARIO'
schema = "skiagraph.scenario/1"
name = "other-programs"
truth_images = ["depth", "parts"]

[motion]
clip = "embedded:walk"
last_frame = 11

[rig.ring]
count = 4
size_px = [160, 120]

[tracker.annealed_particle_filter]
SCENARIO
"$program" render --quiet "$work/scenario.toml" --out "$work/set" >/dev/null
for format in coco bvh; do "$program" export --quiet "$work/set" --to "$format" --out "$work/exports/$format" >/dev/null; done

# every program is in one of two environments; tests/pipelines/run.sh makes the other
pipelines="pose2sim-filters anipose-order anipose-ransac anipose-lenses caliscope-gaps"
run() { if [ -x "$1" ]; then "$1" tests/interop/other_programs.py "$work/exports" "$work/set" "${@:2}"; fi; }
run "$folder/python/bin/python" "$@" >"$work/ran.txt"
run target/pipelines-python/bin/python ${@:-$pipelines} >>"$work/ran.txt"
cat "$work/ran.txt"
for row in $([ $# -gt 0 ] && echo "$@" || sed -n 's/^@row("\([^"]*\)".*/\1/p' tests/interop/other_programs.py); do
  grep -q "^$row " "$work/ran.txt" || skip "the program of $row is not installed"
done
