#!/usr/bin/env bash
# euclid3: between two rotations whose quaternions have opposite signs it interpolates to something that is no rotation.
#
# Quaternion.new_interpolate of euclid3 0.01 takes the shorter way where the dot product is negative. For that it conjugates the first quaternion,
# which is the inverse rotation, in place of changing its sign. From 11 to 57 degrees about z, a quarter of the way, with the second quaternion
# negated, the answer has a length of 0.57 and an angle of -41 degrees; 23 would be right. Its matrix then scales by a third. Two quaternions
# that are less than a degree apart give the second one for every fraction. Where the dot product is positive it is right.
#
# Guessed before: 23 degrees both times, or the long way round, but a rotation.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet euclid3==0.01
python/bin/python - <<'PYTHON'
import math
import random
from euclid3 import Quaternion, Vector3


def about_z(degrees, sign=1):
    turn = Quaternion.new_rotate_axis(math.radians(degrees), Vector3(0, 0, 1))
    return Quaternion(sign * turn.w, sign * turn.x, sign * turn.y, sign * turn.z)


def show(first, second, fraction):
    found = Quaternion.new_interpolate(first, second, fraction)
    length = math.hypot(found.w, found.x, found.y, found.z)
    return round(length, 3), round(math.degrees(2 * math.atan2(found.z, found.w)), 2), round((found * Vector3(1, 0, 0)).magnitude(), 3)


same = show(about_z(11), about_z(57), 0.25)
opposite = show(about_z(11), about_z(57, -1), 0.25)
print(f"from 11 to 57 degrees, a quarter: length {same[0]}, {same[1]} degrees; with the sign of the second changed: {opposite[0]}, {opposite[1]}")
print(f"a vector of length 1 turned by them: {same[2]} and {opposite[2]}")
assert same == (1, 22.5, 1)
assert opposite[0] < 0.6 and -45 < opposite[1] < -35 and opposite[2] < 0.5
random.seed(1)
turns = [Quaternion(*(random.gauss(0, 1) for _ in range(4))).normalized() for _ in range(2000)]
broken = sum(abs(show(first, second, 0.5)[0] - 1) > 0.001 for first, second in zip(turns[::2], turns[1::2]))
print(f"of 1000 random pairs {broken} meet half way in something that is no rotation")
assert 400 < broken < 600
small = [show(about_z(10), about_z(10.9), fraction)[1] for fraction in (0, 0.5)]
print(f"from 10 to 10.9 degrees: at 0 {small[0]}, at one half {small[1]}")
assert small == [10.9, 10.9]
PYTHON
