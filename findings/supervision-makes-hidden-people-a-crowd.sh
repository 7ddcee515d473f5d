#!/usr/bin/env bash
# supervision exports a person of two visible parts, or with a hole, as a crowd, which the evaluation of COCO leaves out.
#
# supervision 0.31.2 writes masks of several parts or with holes as run lengths, and then also sets `iscrowd` to 1. The documentation of `as_coco`
# names the run lengths, not the flag. In COCO it means a group of people: pycocotools takes such annotations out of the truth. Run
# lengths do not need it. People behind a chair or with a hand on the hip so vanish from scores: who never finds them has 100 %.
#
# Guessed before: holes filled, or run lengths with `iscrowd` 0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet supervision==0.31.2 pycocotools==2.0.11 opencv-python-headless==5.0.0.93 numpy==2.4.6
python/bin/python - <<'PYTHON'
import contextlib
import io
import json

import cv2
import numpy as np
import supervision
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

cv2.imwrite("image.png", np.zeros((200, 300, 3), np.uint8))
masks = np.zeros((2, 200, 300), bool)
masks[0, 20:180, 20:100] = True
masks[1, 20:180, 180:260] = True
masks[1, 90:110] = False  # A bar in front of the second person.
boxes = np.array([[20, 20, 100, 180], [180, 20, 260, 180]], float)
people = supervision.Detections(xyxy=boxes, mask=masks, class_id=np.array([0, 0]))
supervision.DetectionDataset(["person"], ["image.png"], {"image.png": people}).as_coco(annotations_path="truth.json")
with open("truth.json") as file:
    truth = json.load(file)
crowds = [annotation["iscrowd"] for annotation in truth["annotations"]]


def score(truth):
    found = {"image_id": 1, "category_id": 1, "bbox": [20, 20, 80, 160], "score": 0.9}  # The first person only.
    with contextlib.redirect_stdout(io.StringIO()):
        data = COCO()
        data.dataset = truth
        data.createIndex()
        evaluation = COCOeval(data, data.loadRes([found]), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return float(evaluation.stats[0]), float(evaluation.stats[8])


exported = score(truth)
for annotation in truth["annotations"]:
    annotation["iscrowd"] = 0
right = score(truth)
print("iscrowd", crowds, "; one of two people found: precision and recall", exported, "with iscrowd 0:", right)
assert crowds == [0, 1] and np.allclose(exported, 1) and np.allclose(right, 0.5, atol=0.01)
PYTHON
