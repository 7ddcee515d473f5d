"""F1 and time of OpenCV's MOG2 and KNN on images written by `cargo run --release --example studies -- background`.

    pip install opencv-python-headless
    python background_opencv.py FOLDER

FOLDER contains camNN/{background,frames,exact}/*.png. Both methods learn the background images in order at their own
rate, then classify without learning. Detected shadows count as background. Prints JSON: for each method the F1 over all
pixels, raw and after an opening with 3 x 3 and a closing with 5 x 5, and the mean time of a classification in ms.
"""

import json
import pathlib
import sys
import time

import cv2
import numpy

cv2.setNumThreads(1)
METHODS = {
    "MOG2": lambda: cv2.createBackgroundSubtractorMOG2(detectShadows=True),
    "KNN": lambda: cv2.createBackgroundSubtractorKNN(detectShadows=True),
}


def images(folder):
    for path in sorted(folder.glob("*.png")):
        yield cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def cleaned(mask):
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, numpy.ones((3, 3), numpy.uint8))
    return cv2.morphologyEx(opened, cv2.MORPH_CLOSE, numpy.ones((5, 5), numpy.uint8))


def main(folder):
    result = {}
    for name, make in METHODS.items():
        counts = {"raw": numpy.zeros(3), "cleaned": numpy.zeros(3)}
        seconds, frames = 0.0, 0
        for camera in sorted(pathlib.Path(folder).glob("cam*")):
            model = make()
            for image in images(camera / "background"):
                model.apply(image)
            for image, exact in zip(images(camera / "frames"), images(camera / "exact")):
                begin = time.perf_counter()
                mask = model.apply(image, learningRate=0)
                seconds += time.perf_counter() - begin
                frames += 1
                mask = (mask == 255).astype(numpy.uint8)
                truth = exact > 127
                for kind, found in (("raw", mask > 0), ("cleaned", cleaned(mask) > 0)):
                    counts[kind] += [(found & truth).sum(), (found & ~truth).sum(), (~found & truth).sum()]
        f1 = {kind: 2 * both / (2 * both + more + less) for kind, (both, more, less) in counts.items()}
        result[name] = {"f1": f1, "ms": 1000 * seconds / frames, "frames": frames}
    result["version"] = cv2.__version__
    print(json.dumps(result))


main(sys.argv[1])
