#!/usr/bin/env bash
# perspective-transform (npm): its matrices are rounded to ten decimals, so map coordinates are off by tens of metres.
#
# perspective-transform 1.1.3 makes the plane transformation that takes four corners to four others, as from an image
# to the floor of a room. Before use it rounds the numbers of both matrices to ten decimals, whatever the units. The
# last two of the first three rows are small where coordinates are large, and lose most of their digits. With a pitch
# of 105 x 68 m in metres of its own the corners are right to a hundredth of a millimetre. With the same pitch in the
# coordinates of a map (UTM, 500,000 m east and 5,400,000 m north) they are off by 73 m, and the way back to the image
# by 2,000 pixels. Of millimetres, points are off by a hundredth of one. The README says nothing of it.
#
# Guessed before: corners go to corners, both ways.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init --yes > /dev/null
npm install --silent --no-audit --no-fund perspective-transform@1.1.3
cat > corners.cjs <<'JAVASCRIPT'
const assert = require("node:assert");
const transform = require("perspective-transform");

// The transformation by elimination, without rounding: eight numbers from eight equations, about the middle.
function exact(from, to) {
  const middle = [0, 1].map((axis) => [0, 2, 4, 6].reduce((sum, corner) => sum + to[corner + axis] / 4, 0));
  const rows = [];
  for (let corner = 0; corner < 8; corner += 2) {
    const [x, y] = from.slice(corner, corner + 2);
    const [u, v] = [to[corner] - middle[0], to[corner + 1] - middle[1]];
    rows.push([x, y, 1, 0, 0, 0, -x * u, -y * u, u], [0, 0, 0, x, y, 1, -x * v, -y * v, v]);
  }
  for (let column = 0; column < 8; column++) {
    const best = rows.slice(column).reduce((a, b) => (Math.abs(a[column]) > Math.abs(b[column]) ? a : b));
    const place = rows.indexOf(best);
    [rows[column], rows[place]] = [rows[place], rows[column]];
    for (const row of rows) {
      if (row !== rows[column]) {
        const factor = row[column] / rows[column][column];
        row.forEach((value, index) => (row[index] = value - factor * rows[column][index]));
      }
    }
  }
  const h = rows.map((row, index) => row[8] / row[index]);
  return (x, y) => {
    const depth = h[6] * x + h[7] * y + 1;
    return [(h[0] * x + h[1] * y + h[2]) / depth + middle[0], (h[3] * x + h[4] * y + h[5]) / depth + middle[1]];
  };
}

const image = [0, 0, 1920, 0, 1920, 1080, 0, 1080];
function errors(east, north, unit) {
  const pitch = [0, 68, 105, 60, 80, 0, 20, 3].map((value, index) => unit * (value + (index % 2 ? north : east)));
  const package_ = transform(image, pitch);
  const byHand = exact(image, pitch);
  let there = 0, back = 0, right = 0;
  for (let corner = 0; corner < 8; corner += 2) {
    const [from, to] = [image.slice(corner, corner + 2), pitch.slice(corner, corner + 2)];
    const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    there = Math.max(there, distance(package_.transform(...from), to));
    back = Math.max(back, distance(package_.transformInverse(...to), from));
    right = Math.max(right, distance(byHand(...from), to));
  }
  console.log(`corner at ${east}, ${north}, unit 1/${unit} m: off by ${there}, by hand ${right}; back ${back} pixels`);
  for (const h of [package_.coeffs, package_.coeffsInv]) {
    assert.deepEqual(h, h.map((value) => Number(value.toFixed(10))));
  }
  assert.ok(right < 1e-6);
  return [there, back];
}
const own = errors(0, 0, 1);
assert.ok(own[0] > 1e-6 && own[0] < 2e-5 && own[1] < 1e-4);
const map = errors(500000, 5400000, 1);
assert.ok(map[0] > 70 && map[0] < 76 && map[1] > 2000);
const millimetres = errors(0, 0, 1000);
assert.ok(millimetres[0] > 0.005 && millimetres[0] < 0.02);
JAVASCRIPT
node corners.cjs
