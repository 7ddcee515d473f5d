#!/usr/bin/env bash
# traja: resampling a walk from 120 to 50 frames per second makes it jump: a sway of 50 mm is gone in most frames.
#
# resample_time of traja 25.0.1 puts the new times beside those of the recording, and fills them by a smoothing spline
# through the frames that both share. From 120 to 50 Hz these are every fifth new frame. They keep their values; the
# others lie on the smooth curve, which misses the sway. So a body that sways by 50 mm once a second has steps of up
# to 50 mm within 20 ms, 2.5 m/s, where 0.3 m/s are right. From 100 to 50 Hz, where all new frames are old ones, it is
# right. There is no message, and the number of frames and the times are right.
#
# Guessed before: the values in between, and the speed of the walk.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 matplotlib==3.9.4 \
    shapely==2.2.0 tzlocal==5.3.1 scikit-learn==1.9.1 seaborn==0.13.2
python/bin/python -m pip install --quiet --no-compile --no-deps traja==25.0.1
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import warnings

import numpy as np

with warnings.catch_warnings():
    # On import it says that PyTorch is missing.
    warnings.simplefilter("ignore")
    import traja


def sway(time):
    return 0.05 * np.sin(2 * np.pi * time)


def resampled(rate):
    """The largest error of the sway and its largest speed, from `rate` to 50 Hz over ten seconds."""
    time = np.arange(10 * rate + 1) / rate
    walk = traja.TrajaDataFrame({"x": 1.3 * time, "y": sway(time), "time": time})
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = traja.resample_time(walk, step_time="20ms")
    new = np.arange(len(found)) / 50
    assert len(found) == 501 and np.allclose(found.x, 1.3 * new)
    wrong = np.abs(found.y - sway(new))
    return wrong.max(), (wrong > 0.01).mean(), np.abs(np.diff(found.y)).max() * 50, [str(warning.message) for warning in said]


for rate in (100, 120, 60, 240):
    wrong, share, speed, said = resampled(rate)
    print(f"{rate} to 50 Hz: off by up to {1000 * wrong:.1f} mm, {share:.0%} by more than 10 mm; up to {speed:.2f} m/s; said {said}")
    if rate == 100:
        assert wrong < 1e-6 and speed < 0.32
    else:
        assert wrong > 0.045 and share > 0.6 and speed > 2
PYTHON
