#!/usr/bin/env bash
# simple-cocotools: where an image shows several people, their keypoints are compared in the order of the lists, not by the match of the boxes.
#
# The evaluator of simple-cocotools 1.0.2 gives every detection the keypoints of all people of the image in one row, and takes only the box by its
# index. So perfect predictions that are listed the other way round have a mean distance of 2 widths of a box, not 0, and the keypoints are
# numbered on through all people: two people with three points have six. One label map for three points ends in a KeyError. Boxes are matched
# rightly, with an mAP of 1, and an image of one person is right.
#
# Guessed before: 0 in either order, and three distances.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile simple-cocotools==1.0.2 numpy==2.4.6 scipy==1.17.1
python/bin/python - <<'PYTHON'
import numpy as np
from simple_cocotools import CocoEvaluator

boxes = np.array([[0, 0, 100, 100], [200, 0, 300, 100]], float)
points = np.array([[[10, 10, 1], [50, 50, 1], [90, 90, 1]], [[210, 10, 1], [250, 50, 1], [290, 90, 1]]], float)


def evaluate(truth, order, names=None):
    evaluator = CocoEvaluator(keypoint_labelmap=names)
    people = {"boxes": boxes[truth], "labels": np.ones(len(truth), int), "keypoints": points[truth]}
    found = {"boxes": boxes[order], "labels": np.ones(len(order), int), "keypoints": points[order], "scores": np.linspace(0.9, 0.8, len(order))}
    evaluator.update([found], [people])
    result = evaluator.summarize(verbose=False)
    return float(result["box"]["mAP"]), result["keypoints"]["distance"], len(result["keypoints"]["class_distance"]["1"]["keypoint_distance"])


alone, same, turned = evaluate([0], [0]), evaluate([0, 1], [0, 1]), evaluate([0, 1], [1, 0])
print("perfect predictions, mAP of boxes, mean distance of keypoints, number of keypoints:")
print(f"one person {alone}; two people {same}; the same two, listed the other way round {turned}")
assert alone == (1, 0, 3) and same == (1, 0, 6) and turned == (1, 2, 6)
try:
    evaluate([0, 1], [0, 1], {0: "head", 1: "hip", 2: "foot"})
except KeyError as error:
    print(f"with names for the three points: KeyError {error}")
else:
    raise AssertionError("names for three points were enough")
PYTHON
