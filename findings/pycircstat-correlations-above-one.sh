#!/usr/bin/env bash
# pycircstat: the correlation of a direction with a length can be 5.4; the most that it may be is 1.
#
# `corrcl` of pycircstat 0.0.2 is the correlation of a direction and a number, as of the heading of steps and their
# length. It is the root of (c^2 + s^2 - 2 c s r) / (1 - r^2), of the correlations c and s of the number with cosine
# and sine, and r of these with each other; it lies between 0 and 1. Here it is another number: 5.40 where the length
# is a cosine of the heading, so that it should be 1, and 1.37 for 0.63. Where headings are spread evenly r is near 0,
# and the error is small. Its correlation of two directions is right.
#
# Guessed before: as by the formula.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile setuptools==75.8.0 wheel==0.45.1 numpy==2.2.6 scipy==1.15.3 \
  pandas==2.2.3 decorator==5.2.1 nose==1.3.7
python/bin/python -m pip install --quiet --no-compile --no-deps --no-build-isolation pycircstat==0.0.2
python/bin/python -W ignore - <<'PYTHON'
import numpy as np
import pycircstat


def formula(heading, length):
    c, s, r = (
        np.corrcoef(a, b)[0, 1]
        for a, b in (
            (length, np.cos(heading)),
            (length, np.sin(heading)),
            (np.cos(heading), np.sin(heading)),
        )
    )
    return np.sqrt((c**2 + s**2 - 2 * c * s * r) / (1 - r**2))


def regression(heading, length):
    """The same by another way: how well a wave of the heading fits."""
    waves = np.stack([np.ones_like(heading), np.cos(heading), np.sin(heading)], axis=1)
    fitted = waves @ np.linalg.lstsq(waves, length, rcond=None)[0]
    return np.corrcoef(fitted, length)[0, 1]


random = np.random.default_rng(1)
steps = random.vonmises(1, 2, 500) % (2 * np.pi)
even = random.uniform(0, 2 * np.pi, 500)
noise = random.normal(size=500)
cases = {
    "perfect": (steps, np.cos(steps) + 2),
    "with noise": (steps, np.cos(steps - 2) + 0.8 * noise),
    "evenly spread": (even, np.cos(even - 2) + 0.8 * noise),
}
found = {}
for name, (heading, length) in cases.items():
    found[name] = pycircstat.corrcl(heading, length), formula(heading, length)
    print(f"{name}: {found[name][0]:.3f}, right {found[name][1]:.3f}")
    assert np.isclose(found[name][1], regression(heading, length))
assert found["perfect"][0] > 4 and np.isclose(found["perfect"][1], 1)
assert found["with noise"][0] > 1 > found["with noise"][1]
assert np.isclose(*found["evenly spread"], atol=0.05)
# Two directions.
other = (steps + 0.5 * noise) % (2 * np.pi)
first, second = (np.sin(values - np.angle(np.exp(1j * values).mean())) for values in (steps, other))
right = (first * second).sum() / np.sqrt((first**2).sum() * (second**2).sum())
assert np.isclose(pycircstat.corrcc(steps, other), right)
PYTHON
