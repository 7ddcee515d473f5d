#!/usr/bin/env bash
# bland-altman and pyCompare: the limits of agreement of few subjects are too narrow.
#
# The limits between two ways of measuring are the mean difference, and 1.96 standard deviations to each side. The
# subjects are a sample, so the squares are divided by one less than their number. bland-altman 0.1.4 and pyCompare
# 1.5.4 divide by the number. With five subjects the limits are 11 percent too narrow, with ten 5 percent: a tracker
# agrees better with the markers, the fewer people it was tried with. pyCompare also makes its intervals of the mean
# and the limits of it, with n - 1 degrees of freedom. Nothing is said, and neither documents it.
#
# Guessed before: standard deviations with n - 1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 matplotlib==3.10.3
python/bin/python -m pip install --quiet --no-compile --no-deps bland-altman==0.1.4 pyCompare==1.5.4
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import warnings

import numpy as np
from bland_altman import bland_altman_plot
from matplotlib import pyplot
from pyCompare import blandAltman

# Knee angles of five people by markers and by a tracker, in degrees.
markers = np.array([61.0, 58.5, 64.0, 55.0, 60.5])
tracker = np.array([63.5, 57.0, 68.0, 55.5, 58.0])
difference = markers - tracker
mean = sum(difference) / 5
squares = sum((difference - mean) ** 2)
sample, population = (squares / 4) ** 0.5, (squares / 5) ** 0.5
right = sorted([mean - 1.96 * sample, mean + 1.96 * sample])


def limits(axes):
    """The lowest and highest of the horizontal lines that the plot has: mean and limits."""
    heights = [np.ravel(line.get_ydata()) for line in axes.lines]
    heights = sorted(height[0] for height in heights if len(height) == 2 and height[0] == height[1])
    return [heights[0], heights[-1]]


with warnings.catch_warnings():
    # That a figure cannot be shown without a screen.
    warnings.simplefilter("ignore")
    bland_altman_plot(markers, tracker)
    found = {"bland-altman": limits(pyplot.gca())}
    _, axes = pyplot.subplots()
    blandAltman(markers, tracker, ax=axes)
    found["pyCompare"] = limits(axes)
for name, ends in found.items():
    print(name, np.round(ends, 2), "right", np.round(right, 2), f"width {(ends[1] - ends[0]) / (right[1] - right[0]):.3f} of it")
    assert np.allclose(ends, [mean - 1.96 * population, mean + 1.96 * population], atol=0.01)
    assert abs((ends[1] - ends[0]) / (right[1] - right[0]) - 0.8**0.5) < 0.005
PYTHON
