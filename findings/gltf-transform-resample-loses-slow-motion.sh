#!/usr/bin/env bash
# glTF Transform: `resample`, which is said to be lossless, removes slow movements that are sampled often: a sway of 20 mm is gone.
#
# The documentation of `resample` in @gltf-transform/functions 4.5.1 says that it removes duplicate keyframes without loss. Its tolerance is 0.0001.
# A key is judged only between the last key that is left and the very next one, which is close by if the rate is high. So a curve is left step by
# step. The higher the rate, the larger the error: ten seconds per sway give 1 mm at 30 frames per second, 10 mm at 120, and at 240 two of 4,801
# keys are left, so that nothing moves. A head that turns by 10 degrees to each side in the same time is a degree off at 240. Fast motions at
# low rates stay close.
#
# Guessed before: nothing is farther off than the tolerance.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent @gltf-transform/core@4.5.1 @gltf-transform/functions@4.5.1
cat > sway.mjs <<'SCRIPT'
import assert from 'node:assert';
import { Document, Logger, Verbosity } from '@gltf-transform/core';
import { resample } from '@gltf-transform/functions';

const seconds = 20;
const angle = (z, w) => (2 * Math.atan2(z, w) * 180) / Math.PI;
const sway = { path: 'translation', at: (t) => [0.02 * Math.sin(0.2 * Math.PI * t), 1, 0], read: ([x]) => x };
const turn = {
  path: 'rotation',
  at: (t) => [0, 0, Math.sin((Math.PI / 36) * Math.sin(0.2 * Math.PI * t)), Math.cos((Math.PI / 36) * Math.sin(0.2 * Math.PI * t))],
  read: ([, , z, w]) => angle(z, w),
};

async function after({ path, at, read }, rate) {
  const document = new Document().setLogger(new Logger(Verbosity.SILENT));
  const buffer = document.createBuffer();
  const hips = document.createNode('Hips');
  document.createScene().addChild(hips);
  const times = Array.from({ length: seconds * rate + 1 }, (_, frame) => frame / rate);
  const values = times.map(at);
  const size = values[0].length;
  const input = document.createAccessor().setType('SCALAR').setArray(new Float32Array(times)).setBuffer(buffer);
  const output = document.createAccessor().setType(`VEC${size}`).setArray(new Float32Array(values.flat())).setBuffer(buffer);
  const sampler = document.createAnimationSampler().setInterpolation('LINEAR').setInput(input).setOutput(output);
  const channel = document.createAnimationChannel().setTargetNode(hips).setTargetPath(path).setSampler(sampler);
  document.createAnimation('stand').addSampler(sampler).addChannel(channel);
  await document.transform(resample());

  const keys = [...sampler.getInput().getArray()];
  const left = keys.map((_, key) => read([...sampler.getOutput().getArray().slice(size * key, size * (key + 1))]));
  let key = 0;
  const error = times.map((time, frame) => {
    while (key < keys.length - 2 && keys[key + 1] < time) key += 1;
    const part = (time - keys[key]) / (keys[key + 1] - keys[key]);
    return Math.abs(left[key] * (1 - part) + left[key + 1] * part - read(values[frame]));
  });
  return { keys: keys.length, of: times.length, error: Math.max(...error) };
}

const found = {};
for (const rate of [30, 120, 240]) {
  found[rate] = await after(sway, rate);
  console.log(`sway of 20 mm at ${rate}: ${found[rate].keys} of ${found[rate].of} keys, off by ${(1000 * found[rate].error).toFixed(1)} mm`);
}
const head = await after(turn, 240);
console.log(`turn of 10 degrees at 240: ${head.keys} of ${head.of} keys, off by ${head.error.toFixed(2)} degrees`);
assert.ok(found[30].error > 0.0009 && found[30].error < 0.001);
assert.ok(found[120].error > 0.009);
assert.equal(found[240].keys, 2);
assert.ok(found[240].error > 0.0199);
assert.ok(head.error > 1);
SCRIPT
node sway.mjs
