#!/usr/bin/env bash
# dlc2kinematics: a joint angle is measured at the body part that is second in the table, not in the list that asks for it.
#
# `compute_joint_angles` of dlc2kinematics 0.0.7 takes the columns of the three body parts in the order of the file. A table with the columns
# shoulder, wrist, elbow gives the angle at the wrist for ["shoulder", "elbow", "wrist"]: 135 degrees where the elbow has 90. There is no message.
# `compute_joint_quaternions` takes the same list in its own order. The columns of DeepLabCut are in the order of the project's configuration.
#
# Guessed before: the angle at the second name of the list, as its example (shoulder, elbow, wrist) has it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet dlc2kinematics==0.0.7 pandas==2.3.3 numpy==1.24.4
python/bin/python -W ignore - <<'PYTHON'
import dlc2kinematics
import numpy as np
import pandas

points = {"shoulder": [0, 0, 0], "elbow": [10, 0, 0], "wrist": [10, 10, 0]}
wanted = {"elbow": ["shoulder", "elbow", "wrist"]}
upper, lower = (np.subtract(points[wanted["elbow"][end]], points["elbow"]) for end in (0, 2))
right = float(np.degrees(np.arccos(upper @ lower / np.linalg.norm(upper) / np.linalg.norm(lower))))
found = {}
for order in (["shoulder", "elbow", "wrist"], ["shoulder", "wrist", "elbow"]):
    columns = pandas.MultiIndex.from_product([["scorer"], order, ["x", "y", "z"]], names=["scorer", "bodyparts", "coords"])
    row = [float(value) for name in order for value in points[name]]
    table = pandas.DataFrame([row] * 3, columns=columns)
    angles = dlc2kinematics.compute_joint_angles(table, wanted, save=False)
    quaternion = dlc2kinematics.compute_joint_quaternions(table, wanted, save=False).iloc[0].astype(float)
    found[" ".join(order)] = (round(float(angles["elbow"][0]), 6), round(float(2 * np.degrees(np.arccos(quaternion.iloc[0]))), 6))
print("degrees at the elbow:", right, "; by columns, as angle and as quaternion:", found)
assert right == 90 and found == {"shoulder elbow wrist": (90, 90), "shoulder wrist elbow": (135, 90)}
PYTHON
