#!/usr/bin/env bash
# filterpy and pfilter: residual resampling drops light particles for good, and so moves the mean of the particles.
#
# A particle filter draws its particles again by their weights: of n particles one of weight w is to be there n w
# times on average. Residual resampling takes the whole part of n w first, and draws the rest by what is left of n w.
# filterpy 2.0.0 and pfilter 0.2.5 draw it by what is left of w after the whole part is taken from it, which is below
# 0 for every heavy particle. Of six particles, those with 0.12, 0.30 and 0.66 expected copies are never there, and
# one with 1.08 is there 1.5 times. Their other ways (systematic, stratified, multinomial) are right. Nothing is said.
#
# Guessed before: n w copies on average, by each way.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 matplotlib==3.10.3
python/bin/python -m pip install --quiet --no-compile --no-deps filterpy==2.0.0 pfilter==0.2.5
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import numpy as np
import pfilter
from filterpy import monte_carlo

np.random.seed(1)
weights = np.array([0.02, 0.18, 0.05, 0.35, 0.11, 0.29])
places = np.array([0.0, 1, 2, 3, 4, 5])
expected = len(weights) * weights


def copies(way):
    """How often each particle is there, on average over 4000 times."""
    drawn = [np.asarray(way(weights.copy())).astype(int) for _ in range(4000)]
    return np.mean([np.bincount(indices, minlength=len(weights)) for indices in drawn], axis=0)


def by_hand(weights):
    whole = np.floor(len(weights) * weights).astype(int)
    rest = len(weights) * weights - whole
    drawn = np.random.choice(len(weights), size=len(weights) - whole.sum(), p=rest / rest.sum())
    return np.concatenate([np.repeat(np.arange(len(weights)), whole), drawn])


print("expected copies", np.round(expected, 2), "mean", round(weights @ places, 2))
assert np.abs(copies(by_hand) - expected).max() < 0.05
for name, package in (("filterpy", monte_carlo), ("pfilter", pfilter)):
    found = copies(package.residual_resample)
    print(name, "residual", np.round(found, 2), "mean", round(found @ places / len(weights), 2))
    assert (found[[0, 2, 4]] < 0.01).all() and found[1] > 1.4 and found[3] > 2.9
    for other in ("systematic_resample", "stratified_resample", "multinomial_resample"):
        assert np.abs(copies(getattr(package, other)) - expected).max() < 0.05
PYTHON
