#!/usr/bin/env bash
# A joint of urdf-loader stops at its limit, and the joint that mimics it goes on.
#
# urdf-loader 0.13.1 cuts a value at the limits of the joint it is set to, but gives the joints that mimic it the value from before the cut. With two
# fingers of a gripper, one at its limit of 1 stays there while the other, with room up to 4, goes to 3: the pose breaks the rule of the file.
# When a file is read, the rule does not hold either: a mimicking joint with an offset is at 0 until its leader is set once.
#
# Guessed before: the follower takes what its leader really has.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . urdf-loader@0.13.1 three@0.187.0 jsdom@29.1.1
cat > look.mjs <<'JAVASCRIPT'
import assert from "node:assert";
import { JSDOM } from "jsdom";
const { window } = new JSDOM("");
for (const name of ["DOMParser", "Document", "Element", "Node"]) globalThis[name] = window[name];
const { default: URDFLoader } = await import("urdf-loader");

const finger = (name, upper, more) => `<link name="${name}_tip"/><joint name="${name}" type="prismatic"><parent link="palm"/>
  <child link="${name}_tip"/><axis xyz="0 0 1"/><limit lower="0" upper="${upper}" effort="1" velocity="1"/>${more}</joint>`;
const robot = new URDFLoader().parse(`<robot name="gripper"><link name="palm"/>
  ${finger("left", 1, "")}${finger("right", 4, '<mimic joint="left"/>')}${finger("thumb", 4, '<mimic joint="left" offset="0.5"/>')}</robot>`);
const values = () => ["left", "right", "thumb"].map((name) => robot.joints[name].angle);
console.log("as read:", values());
assert.deepEqual(values(), [0, 0, 0]);
robot.setJointValue("left", 0);
console.log("left set to 0:", values());
assert.deepEqual(values(), [0, 0, 0.5]);
robot.setJointValue("left", 3);
console.log("left set to 3:", values());
assert.deepEqual(values(), [1, 3, 3.5]);
JAVASCRIPT
node look.mjs
