#!/usr/bin/env bash
# Babylon.js: its loader of BVH mirrors a motion that its loader of glTF shows as it was: who lifts the left hand lifts the right one.
#
# Both formats are right-handed, and the scene of Babylon.js is left-handed unless told otherwise. Its loader of glTF turns one axis for that. The
# loader of BVH in @babylonjs/loaders 9.28.0 copies the numbers, also into a scene that is told to be right-handed, where they are right. So in one
# scene the same person has the left hand at x = -0.7 from a glTF and at 0.7 from a BVH, while both faces look to z. A walk in a left curve is one in
# a right curve. Nothing is said.
#
# Guessed before: mirrored into the axes of the scene, as a glTF.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent @babylonjs/core@9.28.0 @babylonjs/loaders@9.28.0
cat > hand.mjs <<'SCRIPT'
import assert from 'node:assert';
globalThis.XMLHttpRequest = class {};
const { LoadAssetContainerAsync, NullEngine, Scene } = await import('@babylonjs/core');
await import('@babylonjs/loaders/glTF/2.0/index.js');
const { ReadBvh } = await import('@babylonjs/loaders/BVH/bvhLoader.js');

const gltf = {
  asset: { version: '2.0' },
  scene: 0,
  scenes: [{ nodes: [0] }],
  nodes: [
    { name: 'Hips', translation: [0, 1, 0], children: [1, 2] },
    { name: 'LeftHand', translation: [0.7, 0.5, 0] },
    { name: 'Nose', translation: [0, 0.5, 0.25] },
  ],
};
const joint = (name, offset) => `JOINT ${name}
  {
    OFFSET ${offset}
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 0 0.125
    }
  }`;
const bvh = `HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  ${joint('LeftHand', '0.7 0.5 0')}
  ${joint('Nose', '0 0.5 0.25')}
}
MOTION
Frames: 1
Frame Time: 0.0333333
0 1 0 0 0 0 0 0 0 0 0 0
`;
const rounded = (point) => point.asArray().map((value) => Math.round(1000 * value) / 1000 + 0);

async function places(rightHanded) {
  const scene = new Scene(new NullEngine());
  scene.useRightHandedSystem = rightHanded;
  const url = `data:model/gltf+json;base64,${Buffer.from(JSON.stringify(gltf)).toString('base64')}`;
  const loaded = await LoadAssetContainerAsync(url, scene, { pluginExtension: '.gltf' });
  loaded.addAllToScene();
  const nodes = Object.fromEntries(loaded.transformNodes.map((node) => [node.name, node]));
  const skeleton = ReadBvh(bvh, scene, null, { loopMode: 1 });
  for (const bone of skeleton.bones) for (const animation of bone.animations) bone[animation.targetProperty] = animation.evaluate(0);
  skeleton.computeAbsoluteMatrices(true);
  const found = {};
  for (const name of ['LeftHand', 'Nose']) {
    nodes[name].computeWorldMatrix(true);
    const bone = skeleton.bones.find((bone) => bone.name === name);
    found[name] = { gltf: rounded(nodes[name].getAbsolutePosition()), bvh: rounded(bone.getAbsolutePosition()) };
  }
  console.log(rightHanded ? 'right-handed scene:' : 'scene as it comes:', JSON.stringify(found));
  return found;
}

const usual = await places(false);
assert.deepEqual(usual.LeftHand, { gltf: [-0.7, 1.5, 0], bvh: [0.7, 1.5, 0] });
assert.deepEqual(usual.Nose, { gltf: [0, 1.5, 0.25], bvh: [0, 1.5, 0.25] });
const told = await places(true);
assert.deepEqual(told.LeftHand, { gltf: [0.7, 1.5, 0], bvh: [0.7, 1.5, 0] });
process.exit(0);
SCRIPT
node hand.mjs
