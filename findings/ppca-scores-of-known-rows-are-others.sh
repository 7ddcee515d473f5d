#!/usr/bin/env bash
# ppca: the rows that it was fitted on have other scores when they are given again.
#
# `PPCA` of ppca 0.0.4 finds components of data with gaps. `fit` takes the mean of each column off and divides by its
# spread. `transform()` gives the scores of that. `transform(data)` multiplies the data as they are, without either,
# so the same poses have other scores: here their spread is a twentieth, and their middle lies 1.8 off, by the mean
# pose. Poses of a second recording so lie apart from those of the first. Nothing is said. `var_exp`, the share of the
# variance that the components explain, passes 1. Taking `means` off and dividing by `stds` by hand gives the scores
# back.
#
# Guessed before: the scores of `transform()`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3
python/bin/python -m pip install --quiet --no-compile --no-deps ppca==0.0.4
python/bin/python - <<'PYTHON'
import numpy as np
from ppca import PPCA

np.random.seed(1)
random = np.random.default_rng(1)
# Heights of four markers in metres: two movements about a standing body, and 1 mm of noise.
standing = np.array([1.5, 1.0, 0.5, 0.1])
poses = standing + random.normal(size=(300, 2)) @ [[0.05, 0.05, 0.03, 0.0], [0.0, 0.02, 0.05, 0.03]]
poses += 0.001 * random.normal(size=poses.shape)

model = PPCA()
model.fit(poses.copy(), d=2)
fitted, again = model.transform(), model.transform(poses.copy())
by_hand = (poses - poses.mean(0)) / poses.std(0) @ model.C
print("middle of the scores", np.round(fitted.mean(0), 3), "and again", np.round(again.mean(0), 3))
print("spread of the scores", np.round(fitted.std(0), 3), "and again", np.round(again.std(0), 3))
print("explained", np.round(model.var_exp, 4))
assert np.allclose(fitted, by_hand) and np.abs(fitted.mean(0)).max() < 1e-9
assert 1.7 < np.linalg.norm(again.mean(0)) < 2 and np.allclose(again, poses @ model.C)
assert (again.std(0) < 0.1).all() and (fitted.std(0) > 1).all() and model.var_exp[-1] > 1
PYTHON
