"""Masks and keypoints of a recording's videos by MediaPipe, in the form that `skiagraph import` reads.

Usage: python recording_masks.py FOLDER_OF_VIDEOS OUT
"""

import pathlib
import sys

import cv2
import mediapipe
import numpy

videos = sorted(pathlib.Path(sys.argv[1]).glob("*.mp4"))
out = pathlib.Path(sys.argv[2])
points, confidence = [], []
for video in videos:
    (out / "masks" / video.stem).mkdir(parents=True, exist_ok=True)
    capture, pixels, sure = cv2.VideoCapture(str(video)), [], []
    with mediapipe.solutions.pose.Pose(model_complexity=1, enable_segmentation=True) as pose:
        while True:
            read, image = capture.read()
            if not read:
                break
            height, width = image.shape[:2]
            found = pose.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
            mask = numpy.zeros((height, width), numpy.uint8)
            if found.segmentation_mask is not None:
                mask[found.segmentation_mask > 0.5] = 255
            cv2.imwrite(str(out / "masks" / video.stem / f"{len(pixels):06d}.png"), mask)
            seen = found.pose_landmarks.landmark if found.pose_landmarks else []
            # pixel centres at integers
            pixels.append([(p.x * width - 0.5, p.y * height - 0.5) for p in seen] or [(numpy.nan, numpy.nan)] * 33)
            sure.append([p.visibility for p in seen] or [0.0] * 33)
    points.append(pixels)
    confidence.append(sure)
swap = lambda views: numpy.asarray(views, numpy.float64).swapaxes(0, 1)
numpy.savez(out / "keypoints.npz", keypoints=swap(points), confidence=swap(confidence))
