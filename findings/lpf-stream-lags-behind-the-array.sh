#!/usr/bin/env bash
# lpf (npm): the same smoothing of the same signal is several times slower as a stream than as an array.
#
# lpf 1.0.0 is a low-pass filter with one number, `smoothing`. As an array (`smoothArray`) a step reaches 89 percent
# after ten samples with 0.2, as 1 - 0.8^10 has it. As a stream (`next`) it has 45 percent then, and needs 40 samples
# for 87. The stream keeps its own last ten results in place of the samples, and smooths all of them again with each
# new one. A hand that follows the stream is 18 samples behind, not 4. `init` does not empty it: a second signal
# begins in the first. The array is rounded to whole numbers: metres become 0 and 1. The README has examples of both,
# not these differences.
#
# Guessed before: the stream gives what the array gives.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent --no-audit --no-fund lpf@1.0.0
cat > step.cjs <<'JAVASCRIPT'
const assert = require("node:assert");
const filter = require("lpf");

filter.smoothing = 0.2;
const exact = (samples) => 100 * (1 - 0.8 ** samples);
const array = filter.smoothArray([0, ...Array(60).fill(100)]).slice(1);
filter.init(Array(10).fill(0));
const stream = Array.from({ length: 60 }, () => filter.next(100));
for (const samples of [1, 5, 10, 20, 40]) {
  console.log(`after ${samples}: array ${array[samples - 1]}, stream ${stream[samples - 1].toFixed(1)}, exact ${exact(samples).toFixed(1)}`);
  assert.ok(Math.abs(array[samples - 1] - exact(samples)) < 0.51);
}
// Behind a slow movement by as many samples as are missing over the whole step.
const lag = Array.from({ length: 400 }, () => filter.next(100)).concat(stream).reduce((sum, value) => sum + 1 - value / 100, 0);
console.log("behind by", lag.toFixed(1), "samples");
assert.ok(Math.abs(stream[0] - 20) < 1e-9 && stream[9] > 44 && stream[9] < 45.5 && stream[39] > 86 && stream[39] < 88);

// Another signal, which is 0 all the time, after a new start.
filter.init([0, 0, 0]);
const second = filter.next(0);
const metres = filter.smoothArray([0.2, 0.3, 0.4, 0.5, 0.6, 0.7]);
console.log("a second signal of zeros begins with", second.toFixed(1), "and metres become", metres.join(" "));
assert.ok(second > 30);
assert.deepEqual(metres.slice(1), [0, 0, 0, 0, 0]);
JAVASCRIPT
node step.cjs
