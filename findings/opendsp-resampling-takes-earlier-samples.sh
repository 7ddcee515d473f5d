#!/usr/bin/env bash
# opendsp: to a lower rate it takes the sample before each time, to a higher one it stretches the recording.
#
# `resample_hz` of opendsp 0.1.0 changes the rate of a signal. Downwards it takes, for each new time, the last old
# sample at or before it, neither the nearest one nor a value in between. From 120 to 50 Hz the samples are 0, 3.3 and
# 6.7 ms early in turn, so even motion becomes jerky: a speed of 1 m/s has values from 0.83 to 1.25 m/s. Upwards it
# interpolates, and puts the last old sample at the last new place: from 50 to 120 Hz ten seconds are stretched by 12
# ms, and two channels of different rates drift apart. The README calls the package compatible with scipy.signal, and
# says "resampling" of it; `avg=True` is said to average.
#
# Guessed before: samples at their times, as by interpolation.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 opendsp==0.1.0
python/bin/python - <<'PYTHON'
import numpy as np
import opendsp

for old, new in ((120, 60), (120, 50), (100, 30), (240, 100)):
    # A marker that moves by 1 m/s: its position is the time.
    times = np.arange(10 * old) / old
    wanted = np.arange(10 * new) / new
    found = opendsp.resample_hz(times, old, new)
    late = 1000 * (found - wanted)
    speed = np.diff(found) * new
    exact = np.diff(np.interp(wanted, times, times)) * new
    print(f"{old} to {new} Hz: off by {late.min():.1f} to {late.max():.1f} ms, "
          f"speed {speed.min():.2f} to {speed.max():.2f}")
    assert np.allclose(found, np.floor(wanted * old + 1e-6) / old) and np.allclose(exact, 1)
    assert late.max() < 1e-6
    if old % new:
        assert late.min() < -0.5 * 1000 / old and speed.max() > 1.1
late_50 = 1000 * (opendsp.resample_hz(np.arange(1200) / 120, 120, 50) - np.arange(500) / 50)
assert np.allclose(late_50[1:3], [-1000 / 300, -2000 / 300], atol=1e-6)
speed_50 = np.diff(opendsp.resample_hz(np.arange(1200) / 120, 120, 50)) * 50
assert np.isclose(speed_50.min(), 2 / 2.4) and np.isclose(speed_50.max(), 3 / 2.4)

# Upwards: the end of ten seconds.
times, wanted = np.arange(500) / 50, np.arange(1200) / 120
found = opendsp.resample_hz(times, 50, 120)
late = 1000 * (found - wanted)
print(f"50 to 120 Hz: off by {late[0]:.1f} ms in the beginning and {late[-1]:.1f} ms in the end")
assert np.allclose(found, np.linspace(0, times[-1], 1200)) and -12 < late[-1] < -11
PYTHON
