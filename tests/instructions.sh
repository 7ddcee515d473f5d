#!/usr/bin/env bash
# Instructions that the hottest paths take, which other load does not change. Fails if one takes 3 % more than
# results/baselines/instructions.txt says, and names those that take 3 % less, so that the gain is saved.
#
# Usage: bash tests/instructions.sh [program] [--save]
# Needs valgrind. Counts are those of the development build (CARGO_INCREMENTAL=0 cargo build) and of one compiler: another version of
# either may need --save, beside a comparison of both by time (results/speed.md).
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/debug/skiagraph}")
counts=results/baselines/instructions.txt

folder=$(mktemp -d -t skiagraph-instructions.XXXXXX)
trap 'rm -rf "$folder"' EXIT

# name, then the arguments: prints the name and the number of instructions
count() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "${@:2}" --threads 1 --quiet >/dev/null 2>"$folder/log"
  echo "$1 $(sed -n 's/.*Collected : //p' "$folder/log")"
}

"$program" render scenarios/walk.toml --key default --out "$folder/set" --quiet motion.loop_to_s=0.1 rig.ring.size_px='[160, 120]' >/dev/null
track=(track "$folder/set" --tracker annealed_particle_filter --calibrate false --seeds 1)
{
  count "default" "${track[@]}" --out "$folder/default"
  count "as_printed" "${track[@]}" paper=true particles=50 layers=5 --out "$folder/printed"
  count "evaluate" evaluate "$folder/set" "$folder/default"
} | tee "$folder/found"

if [ "${2:-}" = --save ]; then
  cp "$folder/found" "$counts"
  exit
fi
awk '
  NR == FNR { wanted[$1] = $2; next }
  { share = $2 / wanted[$1] - 1; printf "%s: %+.2f %%\n", $1, 100 * share
    if (share < -0.03) print "  save it: bash tests/instructions.sh target/debug/skiagraph --save"
    if (!($2 > 0 && share <= 0.03)) { print "  expected at most 3 % more than " wanted[$1]; failed = 1 } }
  END { exit failed }
' "$counts" "$folder/found"
