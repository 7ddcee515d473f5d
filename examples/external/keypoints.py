#!/usr/bin/env python3
"""Triangulates the keypoints of a 2D detector: weighted direct linear transform, no model of a body; answers markers.

    skiagraph render scenarios/walk.toml observation.keypoints.layout=halpe26 --out SET
    skiagraph track SET --exec "python examples/external/keypoints.py" --out runs/keypoints

Shoulders, elbows, wrists, hips, knees and ankles are the markers of these names; mid_hip, neck and head, of the layouts
that have them, are the pelvis, the thorax and the top of the head. Without them, the pelvis is taken as the middle of the
hips, and the thorax as the middle of the shoulders, which is some centimetres off on most bodies.
"""
import json
import sys

import numpy as np

LEAST_CONFIDENCE = 0.1
SAME_NAME = ["shoulder", "elbow", "wrist", "hip", "knee", "ankle"]


def undistorted(pixel, camera):
    """Coordinates (x/z, y/z) of a pixel: OpenCV's distortion k1 k2 p1 p2 k3, undone by fixed-point iteration."""
    k1, k2, p1, p2, k3 = camera["distortion"]
    distorted = np.linalg.solve(camera["K"], [*pixel, 1.0])[:2]
    x, y = distorted
    for _ in range(30):
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        tangential = np.array([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y])
        x, y = (distorted - tangential) / radial
    return x, y


def triangulate(seen):
    """The point that projects nearest to all (projection, x, y, weight), in the algebraic sense; None without two."""
    if len(seen) < 2:
        return None
    rows = []
    for projection, x, y, weight in seen:
        rows += [weight * (x * projection[2] - projection[0]), weight * (y * projection[2] - projection[1])]
    point = np.linalg.svd(np.array(rows))[2][-1]
    return point[:3] / point[3] if abs(point[3]) > 1e-12 else None


def points_of(views, cameras, names):
    """World positions of the keypoints by name, metres."""
    found = {name: [] for name in names}
    for view in views:
        camera = cameras[view["camera"]]
        # cameras that move have their pose in every view
        projection = np.column_stack([view.get("R", camera["R"]), view.get("t", camera["t"])])
        for name, point in zip(names, view.get("keypoints") or []):
            if point and point[2] >= LEAST_CONFIDENCE:
                found[name].append((projection, *undistorted(point[:2], camera), point[2]))
    return {name: triangulate(seen) for name, seen in found.items()}


def markers_of(points):
    """HumanEva's markers from the keypoints; null where a keypoint is missing."""

    def middle(part):
        left, right = points[f"left_{part}"], points[f"right_{part}"]
        return None if left is None or right is None else (left + right) / 2

    markers = {f"{side}_{part}": points[f"{side}_{part}"] for side in ("left", "right") for part in SAME_NAME}
    markers |= {"pelvis": points.get("mid_hip", middle("hip")), "thorax": points.get("neck", middle("shoulder"))}
    markers |= {"head_top": points.get("head")}
    return {name: None if place is None else place.tolist() for name, place in markers.items()}


def answer(reply):
    print(json.dumps(reply), flush=True)


def main():
    cameras, names = {}, []
    for line in sys.stdin:
        message = json.loads(line)
        if message["type"] == "hello":
            if "keypoints" not in message:
                sys.exit("the set has no keypoints: render it with observation.keypoints.layout=halpe26")
            cameras = {camera["name"]: camera for camera in message["cameras"]}
            names = message["keypoints"]["names"]
            answer({"type": "ready", "name": "keypoints", "version": "1", "protocol": message["protocol"]})
        elif message["type"] == "frame":
            markers = markers_of(points_of(message["views"], cameras, names))
            if any(markers.values()):
                answer({"type": "pose", "frame": message["frame"], "markers": markers})
            else:
                answer({"type": "lost", "frame": message["frame"]})
        elif message["type"] == "end":
            break


main()
