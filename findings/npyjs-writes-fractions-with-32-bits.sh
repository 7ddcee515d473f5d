#!/usr/bin/env bash
# npyjs writes plain numbers of JavaScript with 32 bits, and nested lists as zeros.
#
# npyjs 1.2.0 picks the type in `dump` by what the numbers look like. Whole numbers get the smallest type that holds them, all others float32,
# although a number of JavaScript has 64 bits and `dump` of an empty list says float64. Times of frames in seconds since 1970 are so rounded to steps
# of 128 s: all frames of a minute have one time. A list of rows, whose type it looks up inside the rows, becomes one zero for each row. It
# says nothing.
#
# Guessed before: float64, and rows as a matrix or an error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . npyjs@1.2.0
cat > write.mjs <<'JAVASCRIPT'
import { writeFileSync } from "node:fs";
import { dump } from "npyjs";
const start = 1700000000;
writeFileSync("times.npy", Buffer.from(dump([0, 1, 2, 3].map((index) => start + index / 25))));
writeFileSync("right.npy", Buffer.from(dump(Float64Array.from([0, 1, 2, 3], (index) => start + index / 25))));
writeFileSync("rows.npy", Buffer.from(dump([[11, 12], [21, 22]])));
JAVASCRIPT
node write.mjs
python3 -m venv python
python/bin/python -m pip install --quiet numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np

times, right, rows = (np.load(f"{name}.npy") for name in ("times", "right", "rows"))
print("plain", times.dtype, np.diff(times), "typed", right.dtype, np.diff(right), "rows", rows.dtype, rows.tolist())
assert times.dtype == np.float32 and (np.diff(times) == 0).all()
assert right.dtype == np.float64 and np.allclose(np.diff(right), 0.04, atol=1e-6)
assert rows.dtype == np.uint8 and rows.tolist() == [0, 0]
PYTHON
