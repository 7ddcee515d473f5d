#!/usr/bin/env bash
# pfilter: a forecast of its particle filter has no noise, so that it is as sure of the far future as of now.
#
# `predictor` of pfilter 0.2.5 runs a copy of the filter forward, and `copy` is to give an exact copy. The copy has
# every function of the filter but the noise. A filter of a walk whose noise is 1 per step has a spread of 2.4 five
# steps after its last observation; its forecast keeps that of the last observation, 0.71, at every step. The first
# observation that is given to `predictor` has no effect either: the documentation has it as the start. Nothing is
# said.
#
# Guessed before, from the documentation: the forecast spreads as the filter does without observations.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6
python/bin/python -m pip install --quiet --no-compile --no-deps pfilter==0.2.5
python/bin/python - <<'PYTHON'
import numpy as np
from pfilter import ParticleFilter, gaussian_noise, squared_error

np.random.seed(1)
walk = ParticleFilter(
    prior_fn=lambda count: np.zeros((count, 1)),
    n_particles=4000,
    dynamics_fn=lambda places: places,
    noise_fn=lambda places: gaussian_noise(places, [1.0]),
    weight_fn=lambda seen, observed: squared_error(seen, observed, 1.0),
)
walk.update(np.array([0.0]))
now = walk.particles.std()
# Prior spread 1 and a reading of spread 1: the variance is 1/2, and 1 more with each step.
assert abs(now - np.sqrt(0.5)) < 0.05
forecast = [copy.particles.std() for copy in walk.predictor(5)]
told = [copy.mean_state[0] for copy in walk.predictor(1, observed=np.array([2.0]))]
itself = []
for _ in range(5):
    walk.update(None)
    itself.append(walk.particles.std())
right = np.sqrt(0.5 + np.arange(1, 6))
print("spread now", round(now, 2), "by steps:", "forecast", np.round(forecast, 2), "filter", np.round(itself, 2))
print("mean of a forecast that is told of 2.0:", round(told[0], 2))
assert np.allclose(forecast, now) and np.allclose(itself, right, rtol=0.05)
assert abs(told[0]) < 0.1
PYTHON
