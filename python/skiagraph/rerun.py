"""Sets and runs in the viewer Rerun: cameras, silhouettes, true and estimated skeletons on one timeline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError, imported
from .paths import PathName, absolute

if TYPE_CHECKING:
    from .benchmark_set import Set
    from .measuring import Run

_GREEN, _RED = (60, 200, 90), (230, 60, 60)


def to_rerun(of: Set, run: Run | None = None, out: PathName | None = None) -> None:
    """Shows a set and a run in Rerun, or writes them into a new file for it, ``.rrd``. Needs the package ``rerun-sdk``.

    The timeline is ``time``, seconds from frame 0. Entities: ``world/cameras/NAME`` with the silhouettes,
    ``world/truth`` (green) if the set has its truth, and ``world/estimate/SEED`` (red) for every seed of the run.

    Raises:
        InputError: `out` exists, or its folder does not; or the run has no markers.
    """
    rerun = imported("rerun", "to_rerun", "rerun-sdk")
    skeletons = [("truth", _GREEN, of.truth.markers)] if hasattr(of, "truth") else []
    if run is not None:
        if "estimate_markers" not in run.estimate:
            raise InputError(f"{run.path} has no estimated markers; it has {', '.join(run.estimate)}")
        of_seeds = zip(run.estimate["seeds"], run.estimate["estimate_markers"], strict=True)
        skeletons += [(f"estimate/{seed}", _RED, points) for seed, points in of_seeds]
    stream = rerun.RecordingStream("skiagraph")
    place = None if out is None else absolute(out, "out")
    if place is None:
        stream.spawn()
    elif place.exists() or not place.parent.is_dir():
        raise InputError(f"{place}: {'exists' if place.exists() else 'has no folder'}; choose another name")
    else:
        stream.save(f"{place}.partial")
    stream.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    names, bones = of.marker_names, _bones(of.body)
    for frame in of:
        stream.set_time("time", duration=frame.time)
        for view in frame.views:
            path, camera = f"world/cameras/{view.camera.name}", view.camera
            # Rerun's pixel (0, 0) is the corner of the image, OpenCV's the centre of a pixel
            K, size = camera.K + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]), [camera.width, camera.height]
            axes = rerun.ViewCoordinates.RDF
            stream.log(path, rerun.Pinhole(image_from_camera=K, resolution=size, camera_xyz=axes))
            stream.log(path, rerun.Transform3D(translation=camera.centre, mat3x3=camera.R.T))
            file = view._message.get("mask")
            image = rerun.EncodedImage(path=file, media_type="image/png") if file else rerun.Clear(recursive=False)
            stream.log(f"{path}/silhouette", image)
        for name, colour, points in skeletons:
            pairs = zip(names, points[frame.index], strict=True)
            known = {name: point for name, point in pairs if np.isfinite(point).all()}
            places, labels = list(known.values()), list(known)
            dots = rerun.Points3D(places, radii=0.02, colors=colour, labels=labels, show_labels=False)
            lines = [[known[end] for end in bone] for bone in bones if all(end in known for end in bone)]
            stream.log(f"world/{name}", dots)
            stream.log(f"world/{name}/bones", rerun.LineStrips3D(lines, radii=0.008, colors=colour))
    stream.flush()
    stream.disconnect()
    if place is not None:
        Path(f"{place}.partial").replace(place)


def _bones(body: dict[str, Any]) -> list[tuple[str, str]]:
    """Names of the ends of bones: every marker and the next one towards the root."""
    parents = [0, *(joint["parent"] for joint in body["joints"])]
    markers = {found["link"]: name for name, found in body["markers"].items()}
    bones = []
    for link, name in markers.items():
        above = parents[link]
        while above and above not in markers:
            above = parents[above]
        if link and above in markers:
            bones.append((markers[above], name))
    return bones
