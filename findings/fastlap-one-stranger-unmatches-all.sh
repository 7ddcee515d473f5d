#!/usr/bin/env bash
# fastlap: with a limit of costs, one object that fits nothing takes the right pairs of others away.
#
# A tracker pairs people of one frame with those of the next by distance, and leaves out pairs beyond a limit. fastlap
# 0.4.0 says of `lapjv` that it is a drop-in for `lap.lapjv`, for such trackers. lap 0.5.13 looks for the
# best pairs within the limit. fastlap looks for the best pairs without one, and then drops those beyond it. Three
# people stand in a row. One leaves at one end, and another enters far from the other end. The cheapest sum is then
# that where everyone takes the next place: all pairs are beyond the limit, and none is left, though two of the three
# have moved by 10 cm only. The lists are of -1, without a message. All its ten exact algorithms do so.
#
# Guessed before: the pairs of lap.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 fastlap==0.4.0 lap==0.5.13
python/bin/python - <<'PYTHON'
import itertools

import fastlap
import lap
import numpy as np


def best(costs, limit):
    """The most pairs within the limit, and of those the cheapest, by trying every one."""
    people = range(len(costs))
    choices = []
    for order in itertools.permutations(people):
        pairs = [(i, j) for i, j in zip(people, order) if costs[i, j] <= limit]
        choices.append((-len(pairs), sum(costs[i, j] for i, j in pairs), pairs))
    return min(choices)[2]


# Squares of distances in metres. The people of 0, 1 and 2 m are seen at 0.1 and 1.1 m; one leaves, one is at -1.5 m.
before, after = np.array([0.0, 1.0, 2.0]), np.array([0.1, 1.1, -1.5])
costs = (before[:, None] - after[None, :]) ** 2
limit = 0.25
right = best(costs, limit)
_, rows, _ = lap.lapjv(costs, extend_cost=True, cost_limit=limit)
_, found, _ = fastlap.lapjv(costs, cost_limit=limit)
print("right", right, "lap", rows.tolist(), "fastlap", found.tolist())
assert right == [(0, 0), (1, 1)] and rows.tolist() == [0, 1, -1]
assert found.tolist() == [-1, -1, -1]
for algorithm in fastlap.get_supported_algorithms():
    kept = sum(row is not None for row in fastlap.solve_lap(costs, algorithm, cost_limit=limit)[1])
    assert kept == (2 if algorithm == "greedy" else 0), algorithm

# Of many frames with one person leaving and another entering, the pairs that are lost.
random = np.random.default_rng(1)
lost = wanted = 0
for _ in range(300):
    before = np.cumsum(random.uniform(0.6, 1.0, 6))
    after = np.append(before[:-1] + 0.1 * random.normal(size=5), random.uniform(-3, 0))
    costs = (before[:, None] - after[None, :]) ** 2
    _, rows, _ = lap.lapjv(costs, extend_cost=True, cost_limit=limit)
    _, found, _ = fastlap.lapjv(costs, cost_limit=limit)
    wanted += (rows[:5] == np.arange(5)).sum()
    lost += ((rows[:5] == np.arange(5)) & (found[:5] != rows[:5])).sum()
print(f"of {wanted} right pairs {lost} are lost")
assert wanted > 1400 and lost > 0.5 * wanted
PYTHON
