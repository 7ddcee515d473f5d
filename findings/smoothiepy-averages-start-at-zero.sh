#!/usr/bin/env bash
# smoothiepy: its weighted average gives the newest sample no weight and begins with 0; its exponential one lets a step from 0 pass unsmoothed.
#
# In smoothiepy 0.1.1 the weights of WeightedMovingAverageFilter1D run from 1 at the oldest sample of the window to 0 at the newest. With five
# samples a step is reached only after the oldest has it, and the first output is 0, whatever the value: a gaze at 800 starts at 0. The filter
# of two dimensions is made of it. GaussianAverageFilter1D weighs the newest most, as its documentation says. ExponentialMovingAverageFilter1D takes
# a filtered value of 0 for "no value yet": a rest at 0 is left at once, one at 1 is left smoothly.
#
# Guessed before: a still signal stays as it is, the newest sample weighs most, and a step is smoothed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile smoothiepy==0.1.1 numpy==2.4.6
python/bin/python - <<'PYTHON'
from smoothiepy import ExponentialMovingAverageFilter1D, GaussianAverageFilter1D, NaiveWeightedMovingAverageFilter2D
from smoothiepy import WeightedMovingAverageFilter1D


def run(smoother, values):
    return [round(float(smoother.next(float(value))), 3) for value in values]


still = run(WeightedMovingAverageFilter1D(5), [800] * 4)
gaze = [tuple(float(value) for value in smoother.next(800.0, 450.0)) for smoother in [NaiveWeightedMovingAverageFilter2D(5)] for _ in range(2)]
pulse = [0] * 6 + [1] + [0] * 5
weighted, gauss = run(WeightedMovingAverageFilter1D(5), pulse)[6:11], run(GaussianAverageFilter1D(5), pulse)[6:11]
print(f"weighted average of a still 800: {still}; in two dimensions {gaze}")
print(f"a single 1, from newest to oldest: weighted {weighted}, Gaussian {gauss}")
assert still == [0, 800, 800, 800] and gaze == [(0, 0), (800, 450)]
assert weighted == [0, 0.1, 0.2, 0.3, 0.4] and gauss == sorted(gauss, reverse=True)
from_zero = run(ExponentialMovingAverageFilter1D(0.2), [0, 0, 0, 10, 10])
from_one = run(ExponentialMovingAverageFilter1D(0.2), [1, 1, 1, 11, 11])
print(f"exponential average, alpha 0.2, of a step of 10: from 0 {from_zero}, from 1 {from_one}")
assert from_zero == [0, 0, 0, 10, 10] and from_one == [1, 1, 1, 3, 4.6]
PYTHON
