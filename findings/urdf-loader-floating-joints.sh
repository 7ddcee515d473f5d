#!/usr/bin/env bash
# urdf-loader turns the origin of a floating or planar joint with the joint, and takes roll, pitch and yaw in the other order.
#
# In a URDF a joint moves in its own frame: first the origin, then the motion. urdf-loader 0.13.1 does it the other way round for the types
# "floating" and "planar": a body whose root joint has the origin (1, 0, 0) and turns by 90 degrees about z jumps to (0, 1, 0). The three angles of a
# floating joint are put together as x, y, z, while the same numbers in `rpy` of an origin are z, y, x: the two differ as soon as two
# of them are not 0. The axis of a planar joint, which is the normal of its plane, is left out of the shift: it is always along x and y.
#
# Guessed before: origin times motion, and one meaning of roll, pitch and yaw.
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

function tip(type, inside, values) {
  const robot = new URDFLoader().parse(`<robot name="body"><link name="world"/><link name="tip"/>
    <joint name="root" type="${type}"><parent link="world"/><child link="tip"/>${inside}</joint></robot>`);
  robot.setJointValue("root", ...values);
  robot.updateMatrixWorld(true);
  return robot.links.tip.matrixWorld.elements.map((value) => Math.round(value * 1e4) / 1e4 + 0);
}
const place = (matrix) => matrix.slice(12, 15);

const quarter = Math.PI / 2;
const turned = tip("floating", '<origin xyz="1 0 0"/>', [0, 0, 0, 0, 0, quarter]);
console.log("turned by 90 degrees at (1, 0, 0):", place(turned));
assert.deepEqual(place(turned), [0, 1, 0]);

const asJoint = tip("floating", "", [0, 0, 0, 0.1, 0.2, 0.3]);
const asOrigin = tip("floating", '<origin rpy="0.1 0.2 0.3"/>', [0, 0, 0, 0, 0, 0]);
const yaw = (matrix) => Math.atan2(matrix[1], matrix[0]), pitch = (matrix) => Math.asin(-matrix[2]);
console.log("yaw and pitch of 0.3 and 0.2 as an origin:", yaw(asOrigin), pitch(asOrigin), "as a joint:", yaw(asJoint), pitch(asJoint));
assert(Math.abs(yaw(asOrigin) - 0.3) < 1e-3 && Math.abs(pitch(asOrigin) - 0.2) < 1e-3);
assert(Math.abs(yaw(asJoint) - 0.3) > 0.02 && Math.abs(pitch(asJoint) - 0.2) > 0.03);

const slid = tip("planar", '<axis xyz="0 1 0"/>', [0.5, 0.25, 0]);
console.log("planar about y, shifted:", place(slid), "has a part along its normal");
assert.deepEqual(place(slid), [0.5, 0.25, 0]);
JAVASCRIPT
node look.mjs
