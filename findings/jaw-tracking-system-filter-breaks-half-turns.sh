#!/usr/bin/env bash
# jaw-tracking-system: where a motion passes a half turn its smoothing turns the body by up to 143 degrees.
#
# `TransformationFilter` of jaw-tracking-system 1.1.1 smooths a motion of 4 x 4 matrices. It makes rotation vectors,
# and smooths their numbers (Savitzky-Golay). A vector of 179 degrees about z is followed by one of 179 degrees about
# -z, as of somebody who turns round, or of a marker body that is calibrated upside down. The numbers jump, and what
# is between them is no rotation near: ten frames around every such place are off, by up to 143 degrees. The motion is
# slow and without noise here. Places, and turns below 180 degrees, are right. The documentation says that rotation
# vectors keep the geometry of rotations better. Turning everything by a fixed amount before, and back, helps.
#
# Guessed before: the rotations are kept.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 h5py==3.13.0 \
  matplotlib==3.10.3
python/bin/python -m pip install --quiet --no-compile --no-deps jaw-tracking-system==1.1.1
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import logging

import numpy as np
from jts.helper import TransformationFilter
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

logging.disable(logging.INFO)
frames = 100


def off(degrees):
    """Errors in degrees of the package, and of smoothing the turns relative to the first one; one frame each."""
    truth = Rotation.from_euler("z", degrees, degrees=True) * Rotation.from_euler("x", 5, degrees=True)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = truth.as_matrix()
    poses[:, 0, 3] = np.arange(frames)
    found = np.asarray(TransformationFilter(window_length=11, poly_order=3).smooth(poses))
    assert np.allclose(found[:, :3, 3], poses[:, :3, 3])
    relative = (truth[0].inv() * truth).as_rotvec()
    by_hand = truth[0] * Rotation.from_rotvec(savgol_filter(relative, 11, 3, axis=0))
    smoothed = Rotation.from_matrix(found[:, :3, :3])
    return tuple(np.degrees((other * truth.inv()).magnitude()) for other in (smoothed, by_hand))


for first, last in ((-30, 30), (150, 210)):
    package, right = off(np.linspace(first, last, frames))
    print(f"turn from {first} to {last}: off by up to {package.max():.1f} degrees in {(package > 1).sum()} frames, "
          f"by hand {right.max():.4f}")
    assert right.max() < 0.01
    if last < 180:
        assert package.max() < 0.01
    else:
        assert 140 < package.max() < 145 and (package > 1).sum() == 10
PYTHON
