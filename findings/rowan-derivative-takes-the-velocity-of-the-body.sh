#!/usr/bin/env bash
# rowan: the derivative of a quaternion takes an angular velocity of the body, its integral one of the room.
#
# rowan 1.3.2 documents calculus.derivative as half the velocity times the quaternion, and calculus.integrate as the exponential of half the
# velocity times the quaternion. integrate does so. derivative multiplies the other way round. So a step of integrate does not go where derivative
# points: at a turn of 90 degrees about z, a spin about x in the room is derived as one about y. Where the velocity lies along the axis of the
# rotation so far, as in the documentation's examples, both agree.
#
# Guessed before: the derivative is what a small step of the integral gives.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile rowan==1.3.2 numpy==2.4.6
python/bin/python - <<'PYTHON'
import numpy as np
import rowan


def spin(start, change):
    """The angular velocity in the room that belongs to a change of a quaternion."""
    return 2 * rowan.multiply(change, rowan.conjugate(start))[1:]


start = rowan.from_axis_angle([0, 0, 1], np.pi / 2)
velocity = np.array([0.4, 0, 0])
step = 1e-6
derived = rowan.calculus.derivative(start, velocity)
stepped = (rowan.calculus.integrate(start, velocity, step) - start) / step
documented = 0.5 * rowan.multiply(np.r_[0, velocity], start)
print("turned by 90 degrees about z, spinning by (0.4, 0, 0); the spin in the room:")
print(f"by a step of integrate {spin(start, stepped).round(4)}, by the documented formula {spin(start, documented).round(4)}")
print(f"by derivative {spin(start, derived).round(4)}")
assert np.allclose(stepped, documented, atol=1e-5)
assert np.allclose(spin(start, derived), [0, 0.4, 0], atol=1e-9)
along = np.array([0, 0, 0.4])
assert np.allclose(rowan.calculus.derivative(start, along), (rowan.calculus.integrate(start, along, step) - start) / step, atol=1e-5)

# Ten seconds at 100 steps a second, once by small steps along the derivative.
moved = turned = start
velocity = np.array([0.4, -0.2, 0.3])
for _ in range(1000):
    turned = rowan.calculus.integrate(turned, velocity, 0.01)
    moved = rowan.normalize(moved + 0.01 * rowan.calculus.derivative(moved, velocity))
angle = np.rad2deg(2 * np.arccos(min(1, abs(float(np.dot(moved, turned))))))
print(f"after ten seconds the two are {angle:.0f} degrees apart")
assert angle > 30
PYTHON
