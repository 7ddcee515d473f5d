#!/usr/bin/env bash
# mvnx: in a file of Xsens that was exported without velocities, the angular velocities are read as velocities, and joint angles as accelerations.
#
# mvnx 0.2 looks not at the names of the elements of a frame, but at their places, and has a fixed list of places for all that MVN can export. An
# export may leave any of them out. Then each number behind it stands under another name: with orientation, position, angularVelocity, jointAngle
# and footContacts in the file, `velocity` has rad/s, `acceleration` has degrees, `angularVelocity` has the contacts of the feet, and `jointAngle`
# is empty. Nothing is said. A file with all elements is right.
#
# Guessed before: each by its name, and what the file lacks is empty.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet mvnx==0.2 numpy==2.4.6
python/bin/python - <<'PYTHON'
from mvnx import MVNX


def frame(kind, time, index):
    more = "" if kind != "normal" else f"""
        <angularVelocity>0.25 0.5 0.75 0.25 0.5 0.75</angularVelocity>
        <jointAngle>10 20 {30 + time}</jointAngle>
        <footContacts>1 0 0 1</footContacts>"""
    return f"""
      <frame time="{time}" index="{index}" tc="00:00:00:00" ms="{time}" type="{kind}">
        <orientation>1 0 0 0 1 0 0 0</orientation>
        <position>0 0 1 0 0 1.2</position>{more}
      </frame>"""


frames = "".join(frame(kind, 0, "") for kind in ("identity", "tpose", "tpose-isb"))
frames += "".join(frame("normal", round(index * 1000 / 60), index) for index in range(3))
with open("walk.mvnx", "w") as file:
    file.write(f"""<?xml version="1.0" encoding="UTF-8"?>
<mvnx version="4">
  <mvn version="2021.0" build="1"/>
  <comment/>
  <subject label="subject" frameRate="60" segmentCount="2" recDate="" originalFilename="" configuration="LowerBody" userScenario="">
    <comment/>
    <segments><segment label="Pelvis" id="1"><points/></segment><segment label="L5" id="2"><points/></segment></segments>
    <sensors/>
    <joints><joint label="jL5S1"><connector1>Pelvis/jL5S1</connector1><connector2>L5/jL5S1</connector2></joint></joints>
    <ergonomicJointAngles/>
    <footContactDefinition/>
    <frames segmentCount="2" sensorCount="0" jointCount="1">{frames}
    </frames>
  </subject>
  <securityCode code="0"/>
</mvnx>
""")
motion = MVNX("walk.mvnx")
for name in ("orientation", "position", "velocity", "acceleration", "angularVelocity", "jointAngle", "footContacts"):
    rows = getattr(motion, name)
    print(f"{name}: {rows[0].tolist() if len(rows) else 'nothing'}")
assert motion.position[0].tolist() == [0, 0, 1, 0, 0, 1.2]
assert motion.velocity[0].tolist() == [0.25, 0.5, 0.75, 0.25, 0.5, 0.75]
assert motion.acceleration[0].tolist() == [10, 20, 30]
assert motion.angularVelocity[0].tolist() == [1, 0, 0, 1]
assert len(motion.jointAngle) == 0 and len(motion.footContacts) == 0
PYTHON
