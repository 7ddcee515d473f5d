#!/usr/bin/env bash
# UnityQuaternionPy: a pitch of 82 degrees or more comes back as one on the other side, 174 degrees away and more.
#
# UnityQuaternionPy 0.1.2 imitates Unity's class, with Euler angles in the order z, x, y. Near a pitch of 90 degrees
# the angles are not unique. It treats all beyond 81.9 degrees as such, drops y, and gives 270 for the pitch, where 90
# is meant, and 90 for -90. The three angles then make a rotation that is 174 to 180 degrees away. A camera that looks
# down at the floor has such a pitch, and so has a forearm. `Angle` gives 200 degrees for two rotations that are 160
# apart, and 360 for a quaternion and its negative. Below 81.9 degrees all angles come back.
#
# Guessed before: the same rotation at every pitch, and an angle of at most 180.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile --no-deps UnityQuaternionPy==0.1.2
python/bin/python - <<'PYTHON'
import math

from UnityQuaternion.Quaternion import Quaternion


def apart(a, b):
    """The angle between two rotations in degrees."""
    return math.degrees(2 * math.acos(min(1, abs(a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w))))


for pitch, lost in ((80, False), (81.8, False), (82, True), (85, True), (90, True), (-80, False), (-85, True)):
    rotation = Quaternion.Euler(pitch, 30, 40)
    angles = rotation.eulerAngles
    wrong = apart(rotation, Quaternion.Euler(*angles))
    print(f"pitch {pitch}, y 30, z 40: comes back as {[round(angle, 1) for angle in angles]}, {wrong:.1f} degrees away")
    assert wrong > 170 if lost else wrong < 0.01
far = Quaternion.Angle(Quaternion.Euler(0, 0, 0), Quaternion.Euler(0, 200, 0))
same = Quaternion.Angle(Quaternion(0, 0, 0, 1), Quaternion(0, 0, 0, -1))
print(f"Angle: {far:.0f} for a turn by 200 degrees, {same:.0f} for a quaternion and its negative")
assert round(far) == 200 and round(same) == 360
PYTHON
