#!/usr/bin/env bash
# circlejerk: the centre of a ball in a mask of 0 and 1 is the corner of the window that was searched.
#
# `circle_fit` of circlejerk 0.2.0 finds the middle of a ball, such as one for calibrating cameras or a marker, in a
# mask of bytes: it tries every place of a window about a first guess. In a mask of 0 and 255 it is exact. In one of 0
# and 1, as from a comparison or from labels, the answer is the last corner of the window: the guess plus the size of
# the window, however far from the ball that is, and even if the guess was exact. Nothing is said, and the values that
# a mask may have are not stated. A mask of bool is an error.
#
# Guessed before: the exact middle of the disc.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6
python/bin/python -m pip install --quiet --no-compile --no-deps circlejerk==0.2.0
python/bin/python - <<'PYTHON'
import numpy as np
from circlejerk import circle_fit

rows, columns = np.mgrid[:100, :140]
disc = (rows - 45) ** 2 + (columns - 60) ** 2 <= 20**2
by_hand = columns[disc].mean(), rows[disc].mean()
assert by_hand == (60, 45)
for guess in ((60, 45), (57, 43), (63, 47)):
    for window in (3, 6, 10, 20):
        ones = circle_fit(disc.astype(np.uint8), guess, 20, search_space=window)
        full = circle_fit(255 * disc.astype(np.uint8), guess, 20, search_space=window)
        print(f"guess {guess}, window {window}: 0 and 1 {ones}, 0 and 255 {full}, right {by_hand}")
        assert tuple(full) == by_hand and tuple(ones) == (guess[0] + window, guess[1] + window)
try:
    circle_fit(disc, (60, 45), 20, search_space=6)
    raise SystemExit("a mask of bool is no error")
except TypeError as error:
    print("bool:", str(error)[:60])
PYTHON
