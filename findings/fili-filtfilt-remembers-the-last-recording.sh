#!/usr/bin/env bash
# fili (npm): a filter that runs forth and back begins a recording with the end of the one before, and the first with 0.
#
# `filtfilt` of an IIR filter of fili 2.0.3 takes a whole recording and is without delay. Its state stays from one call
# to the next, and is 0 in the first. So of a marker that stands still at 5 m the filtered place starts at 2.8 m; after
# that, one that stands at 0 starts at 0.5 m, where the same filter anew gives 0. With one filter for x, y and z the
# axes run into each other. Only the start suffers: a step that is played backwards is not the filtered step backwards.
# `reinit()` before each call makes recordings independent, and the start that of a recording after zeros. In the
# middle all is right: half of the amplitude at the cut-off, in phase.
#
# Guessed before: the same forth and back, so that a reversed recording gives the reversed result.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent fili@2.0.3
cat > still.js <<'SCRIPT'
const assert = require('assert');
const { CalcCascades, IirFilter } = require('fili');

const lowpass = () => new IirFilter(new CalcCascades().lowpass({ order: 1, characteristic: 'butterworth', Fs: 100, Fc: 6 }));
const still = (place) => new Array(100).fill(place);
const show = (name, values) => console.log(name, 'starts at', values[0].toFixed(3), 'ends at', values[values.length - 1].toFixed(3));

// Whatever a low-pass filter does, what stands still has to stay: its gain at 0 Hz is 1.
const filter = lowpass();
const x = filter.filtfilt(still(5));
const y = filter.filtfilt(still(0));
const alone = lowpass().filtfilt(still(0));
show('at 5 m:', x);
show('at 0 m, the same filter:', y);
show('at 0 m, a new filter:', alone);
assert.ok(x[0] > 2.7 && x[0] < 2.9 && Math.abs(x[50] - 5) < 0.001 && Math.abs(x[99] - 5) < 0.001);
assert.ok(y[0] > 0.4 && y[0] < 0.6 && alone.every((value) => value === 0));
filter.reinit();
assert.ok(filter.filtfilt(still(0)).every((value) => value === 0));

const step = Array.from({ length: 100 }, (_, frame) => (frame < 50 ? 0 : 1));
const forth = lowpass().filtfilt(step);
const back = lowpass().filtfilt([...step].reverse()).reverse();
const apart = Math.max(...forth.map((value, frame) => Math.abs(value - back[frame])));
console.log('a step, and the step backwards, are up to', apart.toFixed(2), 'apart');
assert.ok(apart > 0.4);

const sine = Array.from({ length: 4000 }, (_, frame) => Math.sin((2 * Math.PI * 6 * frame) / 100));
const filtered = lowpass().filtfilt(sine);
const along = sine.slice(1000, 3000).reduce((sum, value, frame) => sum + value * filtered[1000 + frame], 0) / 1000;
console.log('gain at the cut-off', along.toFixed(3));
assert.ok(Math.abs(along - 0.5) < 0.001);
SCRIPT
node still.js
