#!/usr/bin/env bash
# scikits.bootstrap: moving blocks never draw the last frame, so that a mean moves and its interval with it.
#
# Neighbouring frames of a recording are alike, so they are drawn in blocks. `bootstrap_indices_moving_block` of
# scikits_bootstrap 1.1.1 says that the last block starts at the length less that of a block. The last one that is
# drawn starts one earlier. So the last frame is never there, for any length of the blocks, even for blocks of one
# frame, where plain drawing has each frame as often as any other. One block of the whole recording is an error. An
# unsteady start or end hardly shows in long recordings, but means of ten trials with a rising score do: of 1 to 9 and
# a last one of 30, blocks of one frame have the mean 5 and not 7.5, which one draw in a thousand reaches; by hand it is
# nearly one in two. With `wrap=True` it is right.
#
# Guessed before: the usual moving blocks.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6
python/bin/python -m pip install --quiet --no-compile --no-deps scikits_bootstrap==1.1.1 typing_extensions==4.12.2
python/bin/python - <<'PYTHON'
import numpy as np
from scikits.bootstrap import bootstrap_indices_moving_block

scores = np.array([1.0, 2, 3, 4, 5, 6, 7, 8, 9, 30])
random = np.random.default_rng(1)


def by_hand(length):
    """Blocks that start at 0 to 10 - length, side by side, cut to ten frames."""
    starts = random.integers(0, 10 - length + 1, size=-(-10 // length))
    return np.concatenate([np.arange(start, start + length) for start in starts])[:10]


def report(name, drawn):
    often = np.bincount(np.ravel(drawn), minlength=10) / len(drawn)
    means = scores[np.array(drawn)].mean(1)
    print(f"{name}: each frame", np.round(often, 2), f"mean {means.mean():.2f}, reach 7.5: {np.mean(means >= 7.5):.3f}")
    return often, means


for length in (1, 2, 5):
    drawn = list(bootstrap_indices_moving_block(scores, n_samples=20000, block_length=length, seed=1))
    often, means = report(f"blocks of {length}", drawn)
    right, right_means = report("      by hand", [by_hand(length) for _ in range(20000)])
    assert often[9] == 0 and right[9] > 0.3
    assert length > 1 or (np.abs(right - 1).max() < 0.05 and abs(right_means.mean() - 7.5) < 0.1)
    assert length > 1 or (abs(means.mean() - 5) < 0.05 and np.mean(means >= 7.5) < 0.01 < 0.4 < np.mean(right_means >= 7.5))
wrapped = list(bootstrap_indices_moving_block(scores, n_samples=20000, block_length=2, wrap=True, seed=1))
often, means = report("with wrap", wrapped)
assert np.abs(often - 1).max() < 0.05
try:
    list(bootstrap_indices_moving_block(scores, n_samples=1, block_length=10))
    raise SystemExit("one block of all frames works")
except ValueError as error:
    print("one block of all frames:", error)
PYTHON
