#!/usr/bin/env bash
# three.js: `AnimationUtils.subclip` takes one frame too many or too few at most cuts of a motion from a BVH file.
#
# subclip of three 0.187.0 keeps the keys whose time, a 32-bit float, times the rate is at least the first frame and below the last one, without
# rounding. A frame that falls a trifle below its number belongs to the cut before: it is missing at the start, or follows at the end. With the
# frame time 0.0333333 of most BVH files this is every frame but the first; also with exact thirtieths two of three cuts have other frames.
#
# Guessed before: the frames asked for, but perhaps for a rare one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent three@0.187.0
cat > cut.mjs <<'SCRIPT'
import assert from 'node:assert';
import { AnimationClip, AnimationUtils, VectorKeyframeTrack } from 'three';
import { BVHLoader } from 'three/examples/jsm/loaders/BVHLoader.js';

const count = 300;
const lines = Array.from({ length: count }, (_, frame) => `${frame} 90 0 0 0 0`).join('\n');
const { clip: walk } = new BVHLoader().parse(`HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {
    OFFSET 0 20 0
  }
}
MOTION
Frames: ${count}
Frame Time: 0.0333333
${lines}
`);
const numbers = [...Array(count).keys()];
const exact = new AnimationClip('walk', -1, [
  new VectorKeyframeTrack('Hips.position', numbers.map((frame) => frame / 30), numbers.flatMap((frame) => [frame, 90, 0])),
]);

// x of the hips is the number of the frame.
function frames(clip, first, end) {
  const [track] = AnimationUtils.subclip(clip, 'cut', first, end, 30).tracks.filter((track) => track.name.endsWith('.position'));
  return [track.values[0], track.values.at(-3)];
}
const off = (clip) => numbers.slice(1, 251).filter((first) => frames(clip, first, first + 20).join() !== `${first},${first + 19}`).length;
const found = { cut: frames(walk, 60, 90), bvh: off(walk), exact: off(exact) };
console.log(`frames 60 to 89 of the BVH: first and last are ${found.cut}; of 250 cuts off: BVH ${found.bvh}, exact thirtieths ${found.exact}`);
assert.deepEqual(found.cut, [61, 90]);
assert.equal(found.bvh, 250);
assert.ok(found.exact > 125);
SCRIPT
node cut.mjs
