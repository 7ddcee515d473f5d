#!/usr/bin/env bash
# gait-profile-score: the score is the mean of the scores of the variables, not their root mean square, and so up to three times too small.
#
# gait-profile-score 1.0.2 says that it computes the score "as stated in Baker et al. 2009". There the score of a side is the root mean square of
# nine variables. The package takes their mean. If all nine differ by 5 degrees, both are 5, so that a simple test passes. If only one knee differs,
# by 30 degrees, the side has 3.33 instead of 10. The score of both sides is the mean of the two, with the pelvis twice. Compare no such scores
# with published ones.
#
# Guessed before: the root mean square of the variables.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==1.26.4 pandas==2.2.3 matplotlib==3.9.4 scipy==1.13.1
python/bin/python -m pip install --quiet --no-compile --no-deps gait-profile-score==1.0.2
export MPLBACKEND=Agg
python/bin/python - <<'PYTHON'
import gpscalculator
import numpy as np

reference = gpscalculator.exampleInputData().kinematics()


def scores(changes):
    subject = {name: [value + changes.get(name, changes.get("all", 0)) for value in curve] for name, curve in reference.items()}
    calculation = gpscalculator.calculateGPS(reference, subject)
    calculation.calculateGPS()
    return calculation.gps


for text, changes in (("every variable by 5 degrees", {"all": 5}), ("the left knee by 30 degrees", {"Knee Flexion Left": 30})):
    found = scores(changes)
    left = [value for name, value in found.items() if name.endswith(" Left") and name != "GPS Left"]
    right_score = np.sqrt(np.mean(np.square(left)))
    print(f"{text}: GPS Left {found['GPS Left']:.2f}, root mean square of its {len(left)} variables {right_score:.2f}, GPS {found['GPS']:.2f}")
    assert len(left) == 9 and abs(found["GPS Left"] - np.mean(left)) < 1e-9
    if changes.get("all"):
        assert abs(found["GPS Left"] - 5) < 1e-9 and abs(right_score - 5) < 1e-9
    else:
        assert abs(found["GPS Left"] - 30 / 9) < 1e-9 and abs(right_score - 10) < 1e-9
        assert abs(found["GPS"] - 30 / 18) < 1e-9
PYTHON
