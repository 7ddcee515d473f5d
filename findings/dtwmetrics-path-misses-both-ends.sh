#!/usr/bin/env bash
# dtwmetrics: the warping path of a recording with itself is not the diagonal, and ends outside of it.
#
# dtwmetrics 0.1.2 aligns two sequences by dynamic time warping. Its accumulated costs are right, and so is the
# distance. The path (`dtwm`, `optimal_warping_path`) is not: its second pair is always (0, 1), its last one counts
# from 1, as (6, 6) for six frames 0 to 5, and the pair before the last is missing. Costs summed along it differ from
# the distance, or are an index error. So a step that is compared with itself begins with a lag of one frame, and its
# last frame has no partner. Nothing is said.
#
# Guessed before: a path from the first frames to the last ones, whose costs add up to the distance.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3
python/bin/python -m pip install --quiet --no-compile --no-deps dtwmetrics==0.1.2
python/bin/python - <<'PYTHON'
import numpy as np
from dtwmetrics.dtwmetrics import DTWMetrics


def by_hand(first, second):
    """Distance and path, of steps in one or both sequences."""
    costs = np.abs(first - second.T)
    sums = np.full((len(first) + 1, len(second) + 1), np.inf)
    sums[0, 0] = 0
    for i, j in np.ndindex(costs.shape):
        sums[i + 1, j + 1] = costs[i, j] + min(sums[i, j], sums[i, j + 1], sums[i + 1, j])
    i, j = costs.shape
    path = [(i - 1, j - 1)]
    while path[-1] != (0, 0):
        i, j = min([(i - 1, j - 1), (i - 1, j), (i, j - 1)], key=lambda place: sums[place])
        path.append((i - 1, j - 1))
    return sums[-1, -1], path[::-1], costs


metrics = DTWMetrics()
step = np.arange(6.0)[:, None]
_, sums, path, _ = metrics.dtwm(step, step)
distance, right, _ = by_hand(step, step)
print("with itself:", path.tolist(), "right", right)
assert sums[-1, -1] == distance == 0 and right == [(frame, frame) for frame in range(6)]
assert path.tolist() == [[0, 0], [0, 1], [1, 1], [2, 2], [3, 3], [4, 4], [6, 6]]

# Two walks that are alike and of different speed.
random = np.random.default_rng(1)
for frames, others in ((40, 40), (40, 55), (55, 40)):
    first = np.sin(np.linspace(0, 6, frames))[:, None] + 0.01 * random.normal(size=(frames, 1))
    second = np.sin(np.linspace(0, 6, others))[:, None] + 0.01 * random.normal(size=(others, 1))
    _, sums, path, _ = metrics.dtwm(first, second)
    distance, right, costs = by_hand(first, second)
    print(f"{frames} and {others} frames: begins {path[:3].tolist()}, ends {path[-2:].tolist()}; right {right[-2:]}")
    assert np.isclose(sums[-1, -1], distance) and np.isclose(sum(costs[pair] for pair in right), distance)
    assert path[1].tolist() == [0, 1] and sorted(path[-1].tolist()) == sorted((frames, others))
    assert not any(sorted(pair) == sorted((frames - 1, others - 1)) for pair in path.tolist())
PYTHON
