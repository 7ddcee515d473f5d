#!/usr/bin/env bash
# spm1d: the test of two groups of unequal spread has the statistic for equal spread, and so finds what is not there.
#
# `ttest2` of spm1d 0.4.55 compares two groups of curves, such as knee angles over a step. By default, and with
# equal_var=False, the spreads may differ: Welch's test, in which each group has its own variance. The statistic found
# is that of one pooled variance, the same with equal_var=True. Only the degrees of freedom change. Of 6 curves of
# spread 3 against 40 of spread 1 with the same mean, about a third are called different at the level of 5 percent; by
# Welch's test 5 percent are. Groups of equal size have the right statistic. Nothing is said.
#
# Guessed before: Welch's statistic, as by hand.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 matplotlib==3.10.3 spm1d==0.4.55
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import numpy as np
import spm1d

random = np.random.default_rng(1)


def groups(nodes):
    few = 3 * random.normal(size=(6, nodes)) if nodes else 3 * random.normal(size=6)
    many = random.normal(size=(40, nodes)) if nodes else random.normal(size=40)
    return few, many


def pooled(a, b):
    variance = (((a - a.mean(0)) ** 2).sum(0) + ((b - b.mean(0)) ** 2).sum(0)) / (len(a) + len(b) - 2)
    return (a.mean(0) - b.mean(0)) / np.sqrt(variance * (1 / len(a) + 1 / len(b)))


def welch(a, b):
    return (a.mean(0) - b.mean(0)) / np.sqrt(a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b))


few, many = groups(101)
found = spm1d.stats.ttest2(few, many)
assert np.allclose(found.z, spm1d.stats.ttest2(few, many, equal_var=False).z)
assert np.allclose(found.z, spm1d.stats.ttest2(few, many, equal_var=True).z)
assert np.allclose(found.z, pooled(few, many))
ratio = np.median(np.abs(found.z / welch(few, many)))
print(f"curves: t is {ratio:.2f} times Welch's, with {found.df[1]:.1f} degrees of freedom")
assert 1.7 < ratio < 2.5
same = many[:6]
assert np.allclose(spm1d.stats.ttest2(few, same).z, welch(few, same))

# Single values, with no difference between the groups: 5 of 100 may be called different.
from scipy.stats import t as student

wrong = right = 0
for _ in range(1000):
    few, many = groups(0)
    wrong += spm1d.stats.ttest2(few, many).inference(0.05, two_tailed=True).p < 0.05
    parts = few.var(ddof=1) / len(few), many.var(ddof=1) / len(many)
    freedom = sum(parts) ** 2 / (parts[0] ** 2 / (len(few) - 1) + parts[1] ** 2 / (len(many) - 1))
    right += 2 * student.sf(abs(welch(few, many)), freedom) < 0.05
print(f"called different: {wrong / 1000:.1%}; by Welch's test {right / 1000:.1%}")
assert 270 < wrong < 370 and right < 80
PYTHON
