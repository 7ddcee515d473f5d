#!/usr/bin/env bash
# iaa-kit: Krippendorff's alpha for ordinal scores is that for intervals, and AC2 is weighted kappa.
#
# iaa-kit 0.1.2 measures the agreement of raters, as of two clinicians who score videos of gait from 0 to 4. For
# `scale="ordinal"` Krippendorff's alpha counts how many scores lie between two, so it depends on ranks alone: new
# names for the scores that keep their order change nothing. Its value is that of `scale="interval"`, to the last
# digit, and changes with the names: 0.55 with scores 1, 2, 3, 10 where the ordinal alpha is 0.67. `ac2` by Gwet,
# meant for scores of which most are the same, is `weighted_kappa` to the last digit: -0.04 where AC2 is 0.94. AC1,
# kappa, and the alphas for names and intervals are right. The README lists both measures.
#
# Guessed before: alpha and AC2 by their definitions.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 iaa-kit==0.1.2
python/bin/python - <<'PYTHON'
import iaa_kit
import numpy as np


def alpha(table, scale):
    """Krippendorff's alpha of a table without gaps, from the matrix of coincidences."""
    values = np.unique(table)
    raters = table.shape[1]
    coincidences = np.zeros((len(values), len(values)))
    for row in np.searchsorted(values, table):
        counts = np.bincount(row, minlength=len(values))
        coincidences += (np.outer(counts, counts) - np.diag(counts)) / (raters - 1)
    sums = coincidences.sum(0)
    if scale == "ordinal":
        ranks = np.cumsum(sums) - sums / 2
    else:
        ranks = values
    squares = np.subtract.outer(ranks, ranks) ** 2
    return 1 - (sums.sum() - 1) * (coincidences * squares).sum() / (np.outer(sums, sums) * squares).sum()


def ac2(first, second, scores):
    """Gwet's AC2 with linear weights."""
    weights = 1 - np.abs(np.subtract.outer(range(scores), range(scores))) / (scores - 1)
    share = (np.bincount(first, minlength=scores) + np.bincount(second, minlength=scores)) / (2 * len(first))
    chance = weights.sum() / (scores * (scores - 1)) * (share * (1 - share)).sum()
    return (weights[first, second].mean() - chance) / (1 - chance)


random = np.random.default_rng(0)
truth = random.integers(0, 4, 60)
table = np.stack([np.clip(truth + random.integers(-1, 2, 60), 0, 3) for _ in range(3)], axis=1)
results = []
for names in ([1, 2, 3, 4], [1, 2, 3, 10]):
    scores = np.array(names)[table]
    found = iaa_kit.alpha_value(scores.tolist(), "ordinal")
    interval = iaa_kit.alpha_value(scores.tolist(), "interval")
    results.append((found, alpha(scores, "ordinal")))
    print(f"scores {names}: ordinal {found:.4f}, interval {interval:.4f}, right ordinal {results[-1][1]:.4f}")
    assert found == interval and np.isclose(interval, alpha(scores, "interval"))
(first, right), (second, same) = results
assert np.isclose(right, same) and abs(first - right) > 1e-4 and second < right - 0.1

# Most walks have the score 0, as of healthy people.
one = np.zeros(60, int)
two = np.zeros(60, int)
one[:3], two[5:8] = 1, [1, 2, 1]
found, kappa = iaa_kit.ac2(one.tolist(), two.tolist()), iaa_kit.weighted_kappa(one.tolist(), two.tolist())
print(f"AC2 {found:.4f}, weighted kappa {kappa:.4f}, right AC2 {ac2(one, two, 3):.4f}")
assert found == kappa and ac2(one, two, 3) > 0.9 and found < 0
PYTHON
