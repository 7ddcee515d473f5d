#!/usr/bin/env bash
# ahrs (npm): a level sensor makes the Madgwick filter NaN for ever, and one that is tilted about a single axis is not seen by Mahony.
#
# Both come from readings of exactly 0 in ahrs 1.3.3. Madgwick, the default, divides its correction by the length of the correction. With an
# acceleration of (0, 0, 1) at the start this is 0, and the NaN stays in the quaternion whatever follows. Mahony corrects the gyroscope only if all
# three readings of the accelerometer differ from 0: at a roll of 30 degrees, x reads 0, and the roll stays 0; with x at 0.000001 it is found.
# Sensors of few bits read such zeros, and so does every simulated one. Where no reading is 0, both filters find the roll.
#
# Guessed before: 0 degrees for the level sensor, 30 for the tilted one, by both filters.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent ahrs@1.3.3
cat > still.cjs <<'SCRIPT'
const assert = require('node:assert');
const AHRS = require('ahrs');

const [sine, cosine] = [Math.sin(Math.PI / 6), Math.cos(Math.PI / 6)];
const poses = {
  level: [0, 0, 1],
  'roll 30': [0, sine, cosine],
  'roll 30, x reads 0.000001': [1e-6, sine, cosine],
};

function roll(algorithm, ...stretches) {
  const filter = new AHRS({ sampleInterval: 10, algorithm }); // milliseconds
  for (const [seconds, pose] of stretches) {
    for (let sample = 0; sample < 100 * seconds; sample += 1) filter.update(0, 0, 0, ...poses[pose]);
  }
  return Math.round((filter.getEulerAngles().roll * 180) / Math.PI) + 0;
}

const found = {};
for (const algorithm of ['Madgwick', 'Mahony']) {
  found[algorithm] = [
    roll(algorithm, [0.01, 'level']),
    roll(algorithm, [0.01, 'level'], [60, 'roll 30, x reads 0.000001']),
    roll(algorithm, [60, 'roll 30']),
    roll(algorithm, [60, 'roll 30, x reads 0.000001']),
  ];
  const [level, after, tilted, nearly] = found[algorithm];
  console.log(`${algorithm}: level, one sample ${level}; then a minute at a roll of 30 ${after}`);
  console.log(`${algorithm}: a minute at a roll of 30 from the start ${tilted}; with x at 0.000001 ${nearly}`);
}
assert.deepEqual(found, { Madgwick: [NaN, NaN, 30, 30], Mahony: [0, 30, 0, 30] });
SCRIPT
node still.cjs
