#!/usr/bin/env python3
"""Finds the actor in images by background subtraction with OpenCV, and moves the start pose with the actor.

    skiagraph run scenarios/walk.toml observation.colour_images=png --exec "python examples/external/background.py" --seeds 1

A pixel is foreground where it differs from the median of the background images by more than the setting `threshold`, in
deviations, and not only as a shadow does (the same hue, darker). The body is the largest contour; its centre is
triangulated, and the start pose is moved with it. Masks are not used. Needs NumPy and OpenCV (opencv-python).
"""
import json
import sys

import cv2
import numpy as np

#: Darkening by a shadow, as a share of the brightness.
SHADOW = 0.45


class Background:
    """The scene without people in one camera."""

    def __init__(self, paths):
        # the brightness drifts between the first and the last of them
        images = np.stack([cv2.imread(path, cv2.IMREAD_COLOR) for path in paths]).astype(np.float32)
        self.mean = np.median(images, axis=0)
        self.deviation = images.std(axis=0).mean() + 1.0

    def foreground(self, image, threshold):
        """The mask (height, width) of what is not background, 0 or 255."""
        # averaged over neighbours, because noise differs from pixel to pixel and people do not
        image, mean = cv2.blur(image, (3, 3)), cv2.blur(self.mean, (3, 3))
        differs = np.linalg.norm(image - mean, axis=2) > threshold * self.deviation
        ratios = (image + 1.0) / (mean + 1.0)
        darker = ratios.mean(axis=2)
        is_shadow = (np.ptp(ratios, axis=2) < 0.05) & (darker > 1 - SHADOW) & (darker < 1)
        mask = np.where(differs & ~is_shadow, 255, 0).astype(np.uint8)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        return cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))


def centre_of(mask):
    """The centre of the largest contour, pixels; None without one of at least 30 pixels."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(contours, key=cv2.contourArea, default=None)
    if largest is None or cv2.contourArea(largest) < 30:
        return None
    moments = cv2.moments(largest)
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]


def triangulate(seen):
    """The point nearest to all rays (projection, x, y), by the direct linear transform; None without two."""
    if len(seen) < 2:
        return None
    rows = [row for P, x, y in seen for row in (x * P[2] - P[0], y * P[2] - P[1])]
    point = np.linalg.svd(np.array(rows))[2][-1]
    return point[:3] / point[3]


def answer(reply):
    print(json.dumps(reply), flush=True)


cameras, backgrounds, markers, first, threshold = {}, {}, {}, None, 4.0
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        cameras = {camera["name"]: camera for camera in message["cameras"]}
        if not all(camera.get("background") for camera in message["cameras"]):
            sys.exit("this tracker reads images: render the set with observation.colour_images=png")
        backgrounds = {name: Background(camera["background"]) for name, camera in cameras.items()}
        markers = {name: np.array(place) for name, place in message["start"]["markers"].items() if place}
        threshold = float(message.get("settings", {}).get("threshold", threshold))
        answer({"type": "ready", "name": "background", "version": "1"})
    elif message["type"] == "frame":
        seen = []
        for view in message["views"]:
            camera = cameras[view["camera"]]
            image = cv2.imread(view["colour"], cv2.IMREAD_COLOR).astype(np.float32)
            centre = centre_of(backgrounds[view["camera"]].foreground(image, threshold))
            if centre is None:
                continue
            K, distortion = np.array(camera["K"]), np.array(camera["distortion"])
            x, y = cv2.undistortPoints(np.array([[centre]]), K, distortion)[0, 0]
            seen.append((np.column_stack([camera["R"], camera["t"]]), x, y))
        place = triangulate(seen)
        if place is None:
            answer({"type": "lost", "frame": message["frame"]})
            continue
        first = place if first is None else first
        moved = {name: (start + place - first).tolist() for name, start in markers.items()}
        answer({"type": "pose", "frame": message["frame"], "markers": moved})
    elif message["type"] == "end":
        break
