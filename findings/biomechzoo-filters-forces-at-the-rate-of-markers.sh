#!/usr/bin/env bash
# biomechzoo: one call that filters a marker and a force uses the rate of the first for both, so the force is hardly filtered.
#
# `filter_data` of biomechzoo 0.8.25 looks up the rate of a channel only if the filter has none, and then stores it in the filter. With markers at
# 100 Hz and forces at 1000 Hz, the force after a marker is filtered as if it were at 100 Hz: its cut-off of 10 Hz is 100 Hz, and 50 Hz hum goes
# through. The order of the names decides. A dictionary that the caller gives is changed too, and so keeps the rate for the next file.
#
# Guessed before: each channel at its own rate, as the function knows both.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet biomechzoo==0.8.25 numpy==1.26.4
python/bin/python - <<'PYTHON'
import numpy as np
from biomechzoo.biomech_ops.filter_data import filter_data


def left(channels, filt=None):
    """The amplitude that is left in the middle of a force of 1 N at 50 Hz."""
    time = np.arange(4000) / 1000
    data = {
        "zoosystem": {"Video": {"Freq": 100, "Channels": ["heel"]}, "Analog": {"Freq": 1000, "Channels": ["Fz"]}},
        "heel": {"line": np.zeros(400)},
        "Fz": {"line": np.sin(2 * np.pi * 50 * time)},
    }
    return float(np.abs(filter_data(data, channels, filt)["Fz"]["line"][1000:3000]).max())


alone, after = left("Fz"), left(["heel", "Fz"])
print(f"of 1 N at 50 Hz is left: alone {alone:.6f}, after a marker {after:.6f}")
assert alone < 1e-4 and after > 0.99
own = {"ftype": "butter", "order": 4, "cutoff": 10, "btype": "lowpass"}
left(["heel"], own)
print(f"the filter of the caller is now {own}; a force alone has {left('Fz', own):.6f}")
assert own["fs"] == 100 and left("Fz", own) > 0.99
PYTHON
