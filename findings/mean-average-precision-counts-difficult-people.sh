#!/usr/bin/env bash
# mean_average_precision: people who are marked as difficult count as missed, and the mark goes to other detections.
#
# In the rules of PASCAL VOC an object marked as difficult, such as a person who is all but hidden, is left out: it is
# neither missed, nor is a detection of it right or wrong. mean_average_precision 2024.1.5.0 takes the mark as a column
# of the truth. It still counts these people among those to be found, so three perfect boxes, one of them of a
# difficult person, have an average precision of 0.67, and two of whom one is difficult 0.5. Which detections are left
# out is taken by the place in the list: with person 2 difficult and persons 0 and 1 found, the box of person 1 is left
# out, which gives 0.33 where 1 is right. Without the column, or with the one for crowds, it is right.
#
# Guessed before: the value over the people who are not difficult.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 pandas==2.2.3
python/bin/python -m pip install --quiet --no-compile --no-deps mean-average-precision==2024.1.5.0
python/bin/python -W ignore - <<'PYTHON'
import numpy as np
from mean_average_precision import MetricBuilder


def box(person):
    return [100 * person, 10, 100 * person + 50, 90, 0]


def package(difficult, found, crowd=()):
    """The average precision of perfect boxes of the people in `found`, the surest first; three people are there."""
    truth = np.array([[*box(person), person in difficult, person in crowd] for person in range(3)], float)
    boxes = np.array([[*box(person), 0.9 - 0.1 * place] for place, person in enumerate(found)])
    metric = MetricBuilder.build_evaluation_metric("map_2d", async_mode=False, num_classes=1)
    metric.add(boxes, truth)
    return float(metric.value(iou_thresholds=0.5)["mAP"])


def by_hand(difficult, found):
    """No box is wrong, so the value is the share of the people that count who were found."""
    count = {0, 1, 2} - set(difficult)
    return len(count & set(found)) / len(count)


for difficult, found, seen in (
    ((), (0, 1, 2), 1),
    ((), (0, 1), 2 / 3),
    ((0,), (0, 1, 2), 2 / 3),
    ((1,), (0, 1, 2), 2 / 3),
    ((2,), (0, 1), 1 / 3),
    ((0,), (1, 2), 1 / 3),
    ((0, 1), (2, 0, 1), 1 / 3),
):
    value, right = package(difficult, found), by_hand(difficult, found)
    print(f"difficult {difficult}, found {found}: {value:.2f}, right {right:.2f}")
    assert abs(value - seen) < 1e-6 and (right == 1 or not difficult)
assert package((), (0, 1, 2), crowd=(2,)) == 1
PYTHON
