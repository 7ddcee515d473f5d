"""Sets and runs in the viewer Rerun: cameras, silhouettes, true and estimated skeletons on one timeline."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError, imported

if TYPE_CHECKING:
    from .benchmark_set import Set
    from .measuring import Run
    from .paths import PathName

_GREEN, _RED = (60, 200, 90), (230, 60, 60)


def to_rerun(of: Set, run: Run | None = None, out: PathName | None = None) -> None:
    """Shows a set and a run in Rerun, or writes them into a file for it. Needs the package ``rerun-sdk``.

    The timeline is ``time``, seconds from frame 0. Entities: ``world/cameras/NAME`` with the silhouettes,
    ``world/truth`` (green) if the set has its truth, and ``world/estimate/SEED`` (red) for every seed of the run.

    Args:
        run: a run with estimated markers or joints of the set; without it only the set is shown.
        out: a file that ends in ``.rrd``, which must not exist; without it the viewer is started.

    Raises:
        InputError: `out` exists, or its folder does not.
        MissingPackageError: ``rerun-sdk`` is not installed.
    """
    rerun = imported("rerun", "to_rerun", "rerun-sdk")
    stream = rerun.RecordingStream("skiagraph")
    partial = None
    if out is None:
        stream.spawn()
    else:
        if Path(out).exists():
            raise InputError(f"{Path(out)} exists; choose another name, or remove it")
        if not Path(out).absolute().parent.is_dir():
            raise InputError(f"{Path(out)}: there is no folder {Path(out).absolute().parent}")
        partial = Path(f"{os.fspath(out)}.partial")
        stream.save(partial)
    stream.send_recording_name(of.name)
    stream.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for frame in range(of.frames):
        stream.set_time("time", duration=frame / of.fps)
        _log_cameras(rerun, stream, of, frame)
    skeletons = [("truth", _GREEN, *_truth(of))] if hasattr(of, "truth") else []
    if run is not None:
        skeletons += [(f"estimate/{seed}", _RED, *points) for seed, points in _estimates(run)]
    bones = _bones(of.body)
    for name, colour, names, points in skeletons:
        for frame, places in enumerate(points):
            stream.set_time("time", duration=frame / of.fps)
            _log_skeleton(rerun, stream, f"world/{name}", colour, names, places, bones)
    stream.flush()
    stream.disconnect()
    if partial is not None and out is not None:
        partial.replace(out)


def _log_cameras(rerun: Any, stream: Any, of: Set, frame: int) -> None:
    for index, camera in enumerate(of.cameras_at(frame)):
        path = f"world/cameras/{camera.name}"
        if frame == 0:
            # Rerun's pixel (0, 0) is the corner of the image, OpenCV's the centre of a pixel
            K = camera.K + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
            size = [camera.width, camera.height]
            pinhole = rerun.Pinhole(image_from_camera=K, resolution=size, camera_xyz=rerun.ViewCoordinates.RDF)
            stream.log(path, pinhole, static=True)
        stream.log(path, rerun.Transform3D(translation=camera.centre, mat3x3=camera.R.T))
        masks = of.masks(index)
        if (file := masks._paths[frame]) is None:
            stream.log(f"{path}/silhouette", rerun.Clear(recursive=False))
        else:
            image = rerun.EncodedImage(contents=masks._files.read(file), media_type="image/png")
            stream.log(f"{path}/silhouette", image)


def _bones(body: dict[str, Any]) -> list[tuple[str, str]]:
    """Names of the ends of bones: every marker and the next one towards the root, and the same of the joints."""
    parents = [0, *(joint["parent"] for joint in body["joints"])]
    markers = {found["link"]: name for name, found in body["markers"].items()}
    joints = {link: joint["name"] for link, joint in enumerate(body["joints"], 1)}
    bones = []
    for name_of in (markers, joints):
        for link, name in name_of.items():
            above = parents[link]
            while above and above not in name_of:
                above = parents[above]
            if link and above in name_of:
                bones.append((name_of[above], name))
    return bones


def _truth(of: Set) -> tuple[list[str], NDArray[Any]]:
    return of.truth.marker_names.tolist(), of.truth.markers


def _estimates(run: Run) -> list[tuple[int, tuple[list[str], NDArray[Any]]]]:
    """Names and points (frames, points, 3) of every seed."""
    arrays = run.estimate
    kind, key = ("markers", "marker_names") if "estimate_markers" in arrays else ("joints", "estimate_joint_names")
    if f"estimate_{kind}" not in arrays:
        raise InputError(f"{run.path} has no estimated markers or joints; it has {', '.join(arrays)}")
    of_seeds = zip(arrays["seeds"], arrays[f"estimate_{kind}"], strict=True)
    return [(int(seed), (arrays[key].tolist(), points)) for seed, points in of_seeds]


def _log_skeleton(
    rerun: Any,
    stream: Any,
    path: str,
    colour: tuple[int, int, int],
    names: list[str],
    points: NDArray[Any],
    bones: list[tuple[str, str]],
) -> None:
    """Points with their names, and the bones between those that are known."""
    place = {name: point for name, point in zip(names, points, strict=True) if np.isfinite(point).all()}
    stream.log(
        path, rerun.Points3D(list(place.values()), radii=0.02, colors=colour, labels=list(place), show_labels=False)
    )
    lines = [[place[above], place[below]] for above, below in bones if above in place and below in place]
    stream.log(f"{path}/bones", rerun.LineStrips3D(lines, radii=0.008, colors=colour))
