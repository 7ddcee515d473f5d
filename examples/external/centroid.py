#!/usr/bin/env python3
"""Moves the start pose with the centre of the silhouettes: a tracker in forty lines, as a template for your own.

    skiagraph track SET --exec "python examples/external/centroid.py" --inline --out runs/centroid

The setting `smoothing`, from 0 to below 1, is the weight of the last centre: the first argument, or in `hello`.
"""
import json
import sys

import numpy as np


def centre_of(view, camera):
    """The centre of a silhouette, pixels; None if it is empty."""
    lengths = np.array(view["rle"])
    mask = np.repeat(np.arange(len(lengths)) % 2 == 1, lengths).reshape(camera["height"], camera["width"])
    rows, columns = np.nonzero(mask)
    return (columns.mean(), rows.mean()) if len(rows) else None


def triangulate(views, cameras):
    """The point nearest to the rays through all centres (direct linear transform; lens distortion is ignored)."""
    equations = []
    for view in views:
        camera = cameras[view["camera"]]
        centre = centre_of(view, camera)
        if centre is None:
            continue
        projection = np.array(camera["K"]) @ np.column_stack([camera["R"], camera["t"]])
        equations += [centre[0] * projection[2] - projection[0], centre[1] * projection[2] - projection[1]]
    if len(equations) < 4:
        return None
    point = np.linalg.svd(np.array(equations))[2][-1]
    return point[:3] / point[3]


def answer(reply):
    print(json.dumps(reply), flush=True)


cameras, markers, first, last, smoothing = {}, {}, None, None, 0.0
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        cameras = {camera["name"]: camera for camera in message["cameras"]}
        markers = {name: np.array(place) for name, place in message["start"]["markers"].items() if place}
        settings = message.get("settings", {})
        smoothing = float(sys.argv[1] if len(sys.argv) > 1 else settings.get("smoothing", 0.0))
        answer({"type": "ready", "name": "centroid", "version": "1"})
    elif message["type"] == "frame":
        centre = triangulate(message["views"], cameras)
        if centre is None:
            answer({"type": "lost", "frame": message["frame"]})
            continue
        last = centre if last is None else smoothing * last + (1 - smoothing) * centre
        first = last if first is None else first
        moved = {name: (place + last - first).tolist() for name, place in markers.items()}
        answer({"type": "pose", "frame": message["frame"], "markers": moved})
    elif message["type"] == "end":
        break
