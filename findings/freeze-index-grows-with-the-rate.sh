#!/usr/bin/env bash
# freeze-index: the freeze index of the same movement by Babadi and Brown's spectra is a quarter higher at 100 Hz than at 50 Hz.
#
# compute_babadi_brown_multitaper_fi of freeze-index 1.0.2 takes the rate, and a resolution in hertz. The number of its tapers comes from the number
# of samples in a second, so it doubles with the rate, and spectra are smeared wider. A leg that moves at 1.5 Hz and trembles at 5.2 Hz has an index
# of 3.69 at 50 Hz, 4.37 at 80 Hz and 4.66 at 100 Hz. compute_multitaper_fi has 3.88 at all rates. Resample recordings before thresholds are used.
#
# Guessed before: within 5 percent at every rate.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 loguru==0.7.3
python/bin/python -m pip install --quiet --no-compile --no-deps freeze-index==1.0.2
python/bin/python - <<'PYTHON'
import numpy as np
from freezing.freezeindex import compute_babadi_brown_multitaper_fi, compute_multitaper_fi


def middle(values):
    values = np.asarray(values[1])
    return float(np.median(values[len(values) // 4 : 3 * len(values) // 4]))


found = {}
for rate in (50.0, 80.0, 100.0):
    time = np.arange(0, 120, 1 / rate)
    movement = np.sin(2 * np.pi * 1.5 * time) + 0.7 * np.sin(2 * np.pi * 5.2 * time)
    found[rate] = middle(compute_babadi_brown_multitaper_fi(movement, fs=rate)), middle(compute_multitaper_fi(movement, fs=rate))
    print(f"{rate:g} Hz: {found[rate][0]:.2f} by Babadi and Brown's, {found[rate][1]:.2f} by the other with tapers")
assert 1.24 < found[100.0][0] / found[50.0][0] < 1.28 and found[50.0][0] < found[80.0][0] < found[100.0][0]
assert max(value[1] for value in found.values()) / min(value[1] for value in found.values()) < 1.01
PYTHON
