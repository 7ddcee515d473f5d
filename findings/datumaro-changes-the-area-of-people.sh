#!/usr/bin/env bash
# Datumaro replaces the area of people without a mask by that of their box, and so changes the similarity of keypoints.
#
# The similarity of keypoints (OKS) of COCO divides distances by `area`, which is that of the body: for people without a mask it is often set to about
# half of the box. Datumaro 1.13.12 drops `area` when it reads COCO and writes width times height of the box. A data set that was only read and
# written gives other scores to the same predictions, mostly better ones. There is no message.
#
# Guessed before: `area` is kept, as ids, boxes and flags of keypoints are.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet datumaro==1.13.12 pycocotools==2.0.11
python/bin/python - <<'PYTHON'
import contextlib
import io
import json
import os

import numpy as np
from datumaro import Dataset
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

os.makedirs("before/annotations")
os.makedirs("before/images/train")
Image.new("RGB", (300, 200)).save("before/images/train/image.png")
keypoints = [30, 40, 2, 70, 40, 2, 50, 150, 2]
person = {"id": 1, "image_id": 1, "category_id": 1, "keypoints": keypoints, "num_keypoints": 3, "bbox": [20, 20, 80, 160],
          "area": 0.53 * 80 * 160, "iscrowd": 0, "segmentation": []}
category = {"id": 1, "name": "person", "keypoints": ["left", "right", "foot"], "skeleton": []}
images = [{"id": 1, "file_name": "image.png", "width": 300, "height": 200}]
with open("before/annotations/person_keypoints_train.json", "w") as file:
    json.dump({"images": images, "categories": [category], "annotations": [person]}, file)
Dataset.import_from("before", "coco").export("after", "coco_person_keypoints")


def look(path):
    with contextlib.redirect_stdout(io.StringIO()):
        data = COCO(f"{path}/annotations/person_keypoints_train.json")
        found = {"image_id": 1, "category_id": 1, "keypoints": [value + 8 * (index % 3 < 2) for index, value in enumerate(keypoints)], "score": 1}
        evaluation = COCOeval(data, data.loadRes([found]), "keypoints")
        evaluation.params.kpt_oks_sigmas = np.full(3, 0.08)
        evaluation.evaluate()
    annotation = data.loadAnns([1])[0]
    return annotation["area"], annotation["bbox"], annotation["keypoints"], float(evaluation.ious[1, 1][0, 0])


before, after = look("before"), look("after")
print("area", before[0], "became", after[0], "; similarity of the same prediction", before[3], "became", after[3])
assert before[1:3] == (person["bbox"], keypoints) and [after[1], after[2]] == [person["bbox"], keypoints]
assert np.isclose(before[0], 6784) and after[0] == 80 * 160
assert np.isclose(before[3], np.exp(-(8**2 + 8**2) / (2 * 6784 * 0.16**2))) and np.isclose(after[3], np.exp(-128 / (2 * 12800 * 0.16**2)))
PYTHON
