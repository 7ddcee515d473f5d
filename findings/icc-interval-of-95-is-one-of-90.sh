#!/usr/bin/env bash
# icc: an interval of confidence of 95 percent holds the true agreement in 90 of 100 studies.
#
# `icc` of icc 0.1.1 gives the intraclass correlation of ratings, such as joint angles of the same walks by two
# systems, and its interval. confidence_level is 0.95 by default. Both ends are taken at 5 percent, where 2.5 percent
# each leave 95 between them. For the ratings of Shrout and Fleiss, the one-way interval is -0.10 to 0.64; the right
# one is -0.13 to 0.72. With 20 subjects and 3 raters, the truth of 0.5 is outside in 10 of 100 studies. The default
# arguments are an error: the way of agreement has to be named. Coefficients, F and p are right.
#
# Guessed before: the coefficients and the intervals of Shrout and Fleiss.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3
python/bin/python -m pip install --quiet --no-compile --no-deps icc==0.1.1
python/bin/python - <<'PYTHON'
import numpy as np
from icc import icc
from scipy.stats import f as fisher


def by_hand(ratings, level):
    """The one-way coefficient and its exact interval, from the two mean squares."""
    subjects, raters = ratings.shape
    between = raters * ratings.mean(1).var(ddof=1)
    within = ratings.var(1, ddof=1).mean()
    tail = (1 - level) / 2
    ratio, freedom = between / within, (subjects - 1, subjects * (raters - 1))
    ends = ratio / fisher.ppf(1 - tail, *freedom), ratio / fisher.ppf(tail, *freedom)
    return [(value - 1) / (value + raters - 1) for value in (ratio, *ends)]


# The example of Shrout and Fleiss (1979): six subjects, four judges.
ratings = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float)
way = "oneway", "agreement", "single"
found = icc(ratings, *way, confidence_level=0.95)
right = by_hand(ratings, 0.95)
print("coefficient and interval", np.round([found[0], *found[-2:]], 3), "right", np.round(right, 3))
assert np.allclose([found[0], *found[-2:]], by_hand(ratings, 0.90))
assert np.allclose(right, [0.166, -0.133, 0.723], atol=0.001)

random = np.random.default_rng(1)
inside = exact = 0
for _ in range(4000):
    # Half of the variance is that of the subjects: the true coefficient is 0.5.
    ratings = random.normal(size=(20, 1)) + random.normal(size=(20, 3))
    low, high = icc(ratings, *way)[-2:]
    inside += low <= 0.5 <= high
    _, low, high = by_hand(ratings, 0.95)
    exact += low <= 0.5 <= high
print(f"0.5 is inside in {inside / 40:.1f} of 100 studies, by hand in {exact / 40:.1f}")
assert 3540 < inside < 3660 and 3750 < exact < 3850
try:
    icc(ratings)
    raise SystemExit("the default arguments work")
except ValueError as error:
    print("default arguments:", error)
PYTHON
