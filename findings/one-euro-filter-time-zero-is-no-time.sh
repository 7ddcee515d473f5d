#!/usr/bin/env bash
# OneEuroFilter: a recording whose times start at 0 is filtered otherwise than one that starts at 1, and one missing sample makes all later ones NaN.
#
# OneEuroFilter 0.2.1 takes the rate from the times of samples. A time of 0.0 counts as no time at all, so the first interval has the rate that the
# constructor was given: made for 100 Hz and fed at 10 Hz, a step comes out as 0.06, 0.42, 0.65 from time 0, and as 0.39, 0.62, 0.77 from time 1.
# A NaN, the usual mark of a marker or keypoint that is hidden, stays in its state for ever. Leave out such samples, and start later than 0.
#
# Guessed before: the same result from 0 as from 1, and a NaN that passes once.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile OneEuroFilter==0.2.1
python/bin/python - <<'PYTHON'
import math

from OneEuroFilter import OneEuroFilter


def step(start):
    smooth = OneEuroFilter(freq=100.0, mincutoff=1.0, beta=0.0)
    return [round(smooth(0.0 if frame == 0 else 1.0, start + frame / 10), 3) for frame in range(5)]


print("a step at 10 Hz, times from 0:", step(0.0), "from 1:", step(1.0))
assert step(0.0)[1:4] == [0.059, 0.422, 0.645] and step(1.0)[1:4] == [0.386, 0.623, 0.768]
assert step(2.0) == step(1.0)

smooth = OneEuroFilter(freq=100.0, mincutoff=1.0, beta=0.0)
found = [smooth(math.nan if frame == 2 else 5.0, 1 + frame / 100) for frame in range(100)]
print(f"5 in 100 frames, NaN in one: {sum(map(math.isnan, found))} frames are NaN")
assert found[:2] == [5, 5] and all(map(math.isnan, found[2:]))
PYTHON
