#!/usr/bin/env bash
# rigid-body-motion: angular velocities of the mode "rotation_vector" are wrong unless the axis stands still, and jump by 628 rad/s at a full turn.
#
# `estimate_angular_velocity` of rigid-body-motion 0.9.3 has two modes. With "rotation_vector" it takes the gradient of the rotation vectors and hands
# it out as the angular velocity. That is so only for turns about a fixed axis, or near no rotation. A swaying segment of at most 1.19 rad/s is
# wrong by 0.31 rad/s. A steady turn of 1 rad/s at 100 frames per second has -627 rad/s where a full turn is complete. Nothing is said. The
# default mode "quaternion" is right, in axes of the body.
#
# Guessed before: both modes agree within a percent, as both are said to compute the angular velocity.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile \
    rigid-body-motion==0.9.3 numpy==2.4.6 scipy==1.17.1 numpy-quaternion==2024.0.13 numba==0.68.1 anytree==2.13.0
python/bin/python - <<'PYTHON'
import numpy
from rigid_body_motion import estimate_angular_velocity
from scipy.spatial.transform import Rotation

rate = 100
times = numpy.arange(8 * rate) / rate


def velocity(rotation, mode):
    quaternions = rotation.as_quat()[:, [3, 0, 1, 2]]
    return estimate_angular_velocity(quaternions, timestamps=times, mode=mode)


degrees = [40 * numpy.sin(times), 30 * numpy.sin(1.3 * times + 1), 50 * numpy.sin(0.7 * times + 2)]
sway = Rotation.from_euler("ZXY", numpy.stack(degrees, 1), degrees=True)
truth = (sway[:-1].inv() * sway[1:]).as_rotvec() * rate  # between two frames, in axes of the body
world = (sway[1:] * sway[:-1].inv()).as_rotvec() * rate
print(f"sway: at most {numpy.linalg.norm(truth, axis=1).max():.2f} rad/s")
off = {}
for mode in ("quaternion", "rotation_vector"):
    found = velocity(sway, mode)
    between = (found[1:] + found[:-1]) / 2
    off[mode] = min(numpy.abs(between - truth).max(), numpy.abs(between - world).max())
    print(f"{mode}: wrong by up to {off[mode]:.5f} rad/s")
assert off["quaternion"] < 0.001 and off["rotation_vector"] > 0.3

half = times / 2
turn = numpy.stack([0 * half, 0 * half, numpy.sin(half), numpy.cos(half)], 1)
steady = estimate_angular_velocity(turn[:, [3, 0, 1, 2]], timestamps=times, mode="rotation_vector")[:, 2]
print(f"steady turn of 1 rad/s: from {steady.min():.1f} to {steady.max():.1f} rad/s")
assert steady.min() < -600
PYTHON
