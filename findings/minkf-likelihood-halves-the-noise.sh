#!/usr/bin/env bash
# minkf: the noise that its likelihood fits best has half of the true variance.
#
# `run_filter` of minkf 0.0.5 is a Kalman filter. Asked for the likelihood it gives `loglike`, "the log-likelihood of
# the data given the model", which is meant for finding the noise of a sensor by an optimiser. For n innovations v of
# variance S, minus twice the logarithm is the sum of log S + v^2 / S + log 2 pi. minkf gives log S + v^2 / (2 S) +
# log 2 pi. This is neither the logarithm, nor minus it, nor minus twice it, as one part only is halved. It is least
# where S is half as large. For a marker that wanders by 2 mm a frame and is measured with 10 mm, the best fit is 1.4
# and 7 mm. The filter and the smoother are right.
#
# Guessed before: minus twice the logarithm.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile setuptools==75.8.0 wheel==0.45.1 numpy==2.2.6 scipy==1.15.3
python/bin/python -m pip install --quiet --no-compile --no-deps --no-build-isolation minkf==0.0.5
python/bin/python - <<'PYTHON'
import minkf
import numpy as np
from scipy.optimize import minimize

random = np.random.default_rng(1)
truth = np.cumsum(0.002 * random.normal(size=3000))
measured = truth + 0.010 * random.normal(size=3000)
one = np.eye(1)


def sums(step, noise):
    """The three sums of a filter by hand, and its estimates; the first state is known well."""
    state, variance = 0.0, 1e-8
    logarithms, squares, states = 0.0, 0.0, []
    for value in measured:
        variance += step**2
        spread, innovation = variance + noise**2, value - state
        logarithms += np.log(spread)
        squares += innovation**2 / spread
        state += variance / spread * innovation
        variance -= variance**2 / spread
        states.append(state)
    return logarithms, squares, len(measured) * np.log(2 * np.pi), np.array(states)


def package(step, noise):
    return minkf.run_filter(
        measured[:, None], np.zeros(1), 1e-8 * one, one, one, step**2 * one, noise**2 * one, likelihood=True
    )


logarithms, squares, constant, states = sums(0.002, 0.010)
found = package(0.002, 0.010)
value = float(np.squeeze(found["loglike"]))
log_likelihood = -(logarithms + squares + constant) / 2
print(f"loglike {value:.1f}; by hand {log_likelihood:.1f}, minus twice that {-2 * log_likelihood:.1f}")
assert np.allclose(np.ravel(found["x"]), states)
assert np.isclose(value, logarithms + squares / 2 + constant)
assert not any(np.isclose(value, factor * log_likelihood, rtol=0.01) for factor in (1, -1, 2, -2))


def best(cost):
    start = np.log([0.003, 0.008])
    return np.exp(minimize(lambda both: cost(*np.exp(both)), start, method="Nelder-Mead", options={"xatol": 0.002}).x)


fitted = best(lambda step, noise: float(np.squeeze(package(step, noise)["loglike"])))
right = best(lambda step, noise: sum(sums(step, noise)[:2]))
print("step and noise in mm: fitted", np.round(1000 * fitted, 2), "by hand", np.round(1000 * right, 2), "truth 2 and 10")
assert np.allclose(right, [0.002, 0.010], rtol=0.1)
assert np.allclose(fitted, right / np.sqrt(2), rtol=0.02)
PYTHON
