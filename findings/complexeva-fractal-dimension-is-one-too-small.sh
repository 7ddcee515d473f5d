#!/usr/bin/env bash
# complexeva: Higuchi's fractal dimension is one too small: a line has 0, and noise has 1.
#
# `hfd` of complexeva 0.2.3 is Higuchi's fractal dimension, used for the sway of standing people. The length of the
# curve with steps of k falls with k to the power of minus the dimension: 1 for a line, 1.5 for a random walk, 2 for
# noise. Here they are 0.00, 0.52 and 1.00, below the least that a curve can have: as if the lengths lacked one
# division by k. Sway looks smoother than a straight line, and values do not compare with those of papers. The
# `lyapunov_exponent` of the logistic map, which is log 2 = 0.69, is 8. The README names both measures.
#
# Guessed before: 1 for a line and 2 for noise.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 numba==0.61.2
python/bin/python -m pip install --quiet --no-compile --no-deps complexeva==0.2.3
python/bin/python - <<'PYTHON'
import numpy as np
from complexeva.sequence import hfd, lyapunov_exponent


def higuchi(values, largest):
    """The slope of the logarithm of mean lengths over that of 1 / k."""
    frames = len(values)
    means = []
    for k in range(1, largest + 1):
        lengths = []
        for first in range(k):
            steps = np.abs(np.diff(values[first::k]))
            lengths.append(steps.sum() * (frames - 1) / (len(steps) * k) / k)
        means.append(np.mean(lengths))
    return np.polyfit(-np.log(np.arange(1, largest + 1)), np.log(means), 1)[0]


random = np.random.default_rng(1)
noise = random.normal(size=3000)
curves = {"line": (np.arange(3000.0), 1), "random walk": (np.cumsum(noise), 1.5), "noise": (noise, 2)}
for name, (values, known) in curves.items():
    found, right = hfd(values, 16), higuchi(values, 16)
    print(f"{name}: {found:.3f}, by hand {right:.3f}, known {known}")
    assert abs(right - known) < 0.06 and abs(found - (known - 1)) < 0.06

# The logistic map, whose exponent is log 2: also the mean of the logarithms of its slopes.
chaos = [0.4]
for _ in range(1500):
    chaos.append(4 * chaos[-1] * (1 - chaos[-1]))
chaos = np.array(chaos)
right, found = np.log(np.abs(4 - 8 * chaos)).mean(), lyapunov_exponent(chaos)
print(f"exponent {found:.2f}, right {right:.2f}")
assert abs(right - np.log(2)) < 0.05 and found > 5
PYTHON
