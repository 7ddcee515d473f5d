"""Trackers written in Python: what they are given, what they answer, and the loop that serves them."""

from __future__ import annotations

import contextlib
import inspect
import json
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .arrays import described, unmasked
from .camera import Camera
from .errors import InputError, TrackerError
from .images import picture, silhouette

#: What ``track`` may return: None for a lost frame; an array (points, 3) of all markers or all joints in the order of
#: :class:`SetInfo`; a dictionary of points by name, of markers or of joints; or a dictionary with the keys of an answer
#: of the protocol: ``markers``, ``joints``, or ``root`` and ``angles``, with or without ``confidence``. Metres and
#: radians in the world.
Answer: TypeAlias = Any


class Tracker(Protocol):
    """A tracker with a state. ``start`` is called before the first frame of every seed."""

    def start(self, info: SetInfo) -> object:
        """Prepares for the frames of a set."""

    def track(self, frame: Frame) -> Answer:
        """The estimate of one frame."""


#: A tracker: an object, a class without arguments (one object for every seed), or a function of a frame.
AnyTracker: TypeAlias = Tracker | type[Tracker] | Callable[["Frame"], Answer]


@dataclass(frozen=True, eq=False)
class StartPose:
    """The pose of the tracker's body in frame 0."""

    #: x y z qw qx qy qz of the root in the world, metres (7,).
    root: NDArray[np.float64]
    #: Radians (n,), in the order of :attr:`SetInfo.angles`.
    angles: NDArray[np.float64]
    #: Markers by name, metres (3,); NaN for those that the body lacks.
    markers: dict[str, NDArray[np.float64]]
    #: Joints by name, metres (3,).
    joints: dict[str, NDArray[np.float64]]


class SetInfo:
    """What a tracker is told before the first frame."""

    def __init__(self, hello: Mapping[str, Any]) -> None:
        #: The message ``hello`` of the protocol, with everything that this class does not name.
        self.message = hello
        self.seed: int = hello["seed"]
        self.frames: int = hello["frames"]
        self.fps: float = hello["fps"]
        self.cameras: list[Camera] = [Camera.from_record(record) for record in hello["cameras"]]
        #: Names of markers, joints and angles, in the order of arrays.
        self.markers: list[str] = hello["markers"]
        self.joints: list[str] = hello["joints"]
        self.angles: list[str] = hello["angles"]
        #: Names of the keypoints of :attr:`View.keypoints`; empty if the set has none.
        self.keypoints: list[str] = hello.get("keypoints", {}).get("names", [])
        #: Paths of images of the scene without people by camera, in the order in which they were taken; empty lists if
        #: the set has no images (:attr:`View.image`).
        self.backgrounds: dict[str, list[Path]] = {
            record["name"]: [Path(path) for path in record.get("background", [])] for record in hello["cameras"]
        }
        #: Folder with the set's files that trackers may read: cameras, observations, start.
        self.folder = Path(hello["folder"])
        #: First frame that will be asked for; above 0 after a crash.
        self.first_frame: int = hello.get("first_frame", 0)

    @cached_property
    def start(self) -> StartPose:
        """The pose of the tracker's body in frame 0."""
        found = self.message["start"]
        numbers = {key: np.array(found[key], np.float64) for key in ("root", "angles")}
        markers, joints = _points(found["markers"], self.markers), _points(found["joints"], self.joints)
        return StartPose(**numbers, markers=markers, joints=joints)


class View:
    """What one camera saw of a frame."""

    def __init__(self, message: Mapping[str, Any], camera: Camera) -> None:
        self._message, self._camera = message, camera

    @cached_property
    def camera(self) -> Camera:
        """The camera; where it was for this image, if it moves."""
        if "R" not in self._message:
            return self._camera
        from dataclasses import replace

        return replace(self._camera, R=np.array(self._message["R"]), t=np.array(self._message["t"]))

    @cached_property
    def mask(self) -> NDArray[np.bool_] | None:
        """The silhouette (height, width); None if the camera took no image for this frame. Read lazily."""
        if (path := self._message.get("mask")) is not None:
            return silhouette(Path(path).read_bytes(), path)
        if (lengths := self._message.get("rle")) is not None:
            values = np.arange(len(lengths)) % 2 == 1
            return np.repeat(values, lengths).reshape(self._camera.height, self._camera.width)
        return None

    @cached_property
    def image(self) -> NDArray[np.uint8] | None:
        """What the camera saw (height, width, 3), red first, or (height, width) if it is grey. Read lazily.

        None if the set has no images, or the camera took none for this frame.
        """
        path = self._message.get("colour")
        return None if path is None else picture(Path(path).read_bytes(), path)

    @cached_property
    def keypoints(self) -> NDArray[np.float64] | None:
        """Column, row and confidence (keypoints, 3) of what a detector found, pixels; NaN for what it missed.

        None if the set has no keypoints, or the camera took no image for this frame.
        """
        if (found := self._message.get("keypoints")) is None:
            return None
        return np.array([[np.nan] * 3 if point is None else point for point in found], np.float64).reshape(-1, 3)

    @property
    def exposed(self) -> float | None:
        """When the first row was exposed, seconds, on sets whose cameras move or have their own timing; else None."""
        return self._message.get("exposed_s")


class Frame:
    """One frame as a tracker sees it."""

    def __init__(self, message: Mapping[str, Any], info: SetInfo) -> None:
        #: Number of the frame, from 0.
        self.index: int = message["frame"]
        #: Seconds from frame 0; the pose at this time is wanted.
        self.time: float = message["time_s"]
        #: What is known of the set.
        self.info = info
        self._message = message

    @cached_property
    def views(self) -> list[View]:
        """What every camera saw, in the order of the set's cameras."""
        pairs = zip(self._message["views"], self.info.cameras, strict=True)
        return [View(message, camera) for message, camera in pairs]

    @property
    def masks(self) -> list[NDArray[np.bool_] | None]:
        """The silhouettes of all cameras; None for a camera that took no image."""
        return [view.mask for view in self.views]


def serve(tracker: AnyTracker, *, name: str | None = None) -> None:
    """Makes a program of a tracker: answers skiagraph on standard input and output until it ends.

    A file with ``skiagraph.serve(MyTracker)`` at its end is run by ``skiagraph track SET --exec "python mine.py"``.
    What the tracker prints goes to standard error. An exception ends the program; skiagraph records its last lines.
    """
    answers = sys.stdout
    with contextlib.redirect_stdout(sys.stderr):
        converse(tracker, sys.stdin, answers, name)


def converse(
    tracker: AnyTracker,
    requests: IO[str],
    answers: IO[str],
    name: str | None = None,
    on_frame: Callable[[Frame], object] | None = None,
) -> None:
    """Answers the requests of one seed.

    Raises:
        TrackerError: the tracker raised an exception, which is the cause, or answered something that is no estimate.
    """

    def say(message: Mapping[str, Any]) -> None:
        answers.write(json.dumps(message) + "\n")
        answers.flush()

    info, track = None, _track_of(tracker)
    for line in requests:
        message = json.loads(line)
        if message["type"] == "hello":
            info = SetInfo(message)
            track = _started(tracker, info)
            say({"type": "ready", "name": name or name_of(tracker), "protocol": message["protocol"]})
        elif message["type"] == "frame" and info is not None:
            frame = Frame(message, info)
            try:
                estimate = track(frame)
            except Exception as error:
                raise _raised(info, f"in frame {frame.index}", error) from error
            say(_reply(estimate, frame))
            if on_frame is not None:
                on_frame(frame)
        elif message["type"] == "end":
            return


def name_of(tracker: object) -> str:
    """The name of a tracker's class or function.

    >>> name_of(str.upper)
    'upper'
    """
    named = tracker if hasattr(tracker, "__name__") else type(tracker)
    return str(getattr(named, "__name__", "tracker"))


def _track_of(tracker: Any) -> Callable[[Frame], Answer]:
    track: Callable[[Frame], Answer] | None = getattr(tracker, "track", None if inspect.isclass(tracker) else tracker)
    if track is not None and callable(track):
        return track
    raise TrackerError(
        f"expected a function of a frame, or an object or class with a method track(frame), found {tracker!r}"
    )


def _started(tracker: Any, info: SetInfo) -> Callable[[Frame], Answer]:
    try:
        of_seed: Any = tracker() if inspect.isclass(tracker) else tracker
        if (start := getattr(of_seed, "start", None)) is not None:
            start(info)
    except Exception as error:
        raise _raised(info, "before the first frame", error) from error
    return _track_of(of_seed)


def _raised(info: SetInfo, when: str, error: Exception) -> TrackerError:
    return TrackerError(f"the tracker raised {type(error).__name__} {when} of seed {info.seed}: {error}")


def _reply(estimate: Answer, frame: Frame) -> dict[str, Any]:
    """The message of an answer."""
    if estimate is None:
        return {"type": "lost", "frame": frame.index}
    try:
        pose = _pose(estimate, frame.info)
        points = pose.get("markers") or pose.get("joints") or {}
        if points and not any(points.values()):
            return {"type": "lost", "frame": frame.index}
        return {"type": "pose", "frame": frame.index, **pose}
    except (TypeError, ValueError) as error:
        raise TrackerError(f"the answer to frame {frame.index} of seed {frame.info.seed}: {error}") from error


#: Keys of an answer in the protocol.
_KEYS = frozenset({"markers", "joints", "root", "angles", "confidence"})


def _pose(estimate: Answer, info: SetInfo) -> dict[str, Any]:
    if not isinstance(estimate, Mapping):
        return _pose_of_array(estimate, info)
    names = set(estimate)
    if names and names <= _KEYS:
        return {key: _plain(_named(key, value, info), key) for key, value in estimate.items()}
    for kind, known in (("markers", info.markers), ("joints", info.joints)):
        if names <= set(known):
            return {kind: _plain(estimate, kind)}
    unknown = sorted(map(str, names - set(info.markers) - set(info.joints)))
    raise TrackerError(
        f"expected points by the names of markers ({', '.join(info.markers)}) or of joints ({', '.join(info.joints)}), "
        f"found {', '.join(unknown) or 'names of both'}"
    )


def _named(key: str, value: Any, info: SetInfo) -> Any:
    """The points of an array of all markers or joints by their names; anything else as it is."""
    if key not in ("markers", "joints") or isinstance(value, Mapping):
        return value
    names, array = getattr(info, key), unmasked(value)
    if array.dtype.kind not in "fiu" or array.shape != (len(names), 3):
        raise TrackerError(f"expected {key} of shape ({len(names)}, 3), found {described(value, array)}")
    return dict(zip(names, array, strict=True))


def _pose_of_array(estimate: Answer, info: SetInfo) -> dict[str, Any]:
    array = unmasked(estimate)
    counts = {"markers": len(info.markers), "joints": len(info.joints)}
    kinds = [kind for kind, count in counts.items() if array.shape == (count, 3)]
    if array.dtype.kind not in "fiu" or len(kinds) != 1:
        wanted = " or ".join(f"({count}, 3) of {kind}" for kind, count in counts.items())
        ambiguous = "; as both are as many, return {'markers': ...} or {'joints': ...}" if len(kinds) == 2 else ""
        raise TrackerError(
            f"expected None, a dictionary, or numbers of shape {wanted}, in metres, "
            f"found {described(estimate, array)}{ambiguous}"
        )
    names = info.markers if kinds[0] == "markers" else info.joints
    # in one go, as most answers are complete
    points = array.astype(np.float64).tolist() if np.isfinite(array).all() else array
    return {kinds[0]: _plain(dict(zip(names, points, strict=True)), kinds[0])}


def _plain(value: Any, where: str) -> Any:
    """Numbers of JSON; a point of which all is NaN becomes null.

    Raises:
        InputError: a number is infinite, or NaN beside others that are not.
    """
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, f"{where} {key}") for key, inner in value.items()}
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if type(value) is list and all(type(number) is float and math.isfinite(number) for number in value):
        return value
    array = np.asarray(unmasked(value), np.float64)
    if np.isfinite(array).all():
        return array.tolist()
    if array.ndim > 1:
        return [_plain(row, f"{where}[{index}]") for index, row in enumerate(array)]
    if array.ndim == 1 and np.isnan(array).all():
        return None
    raise InputError(f"{where} is {array.tolist()}; expected finite numbers, or only NaN for a missing point")


def _points(named: Mapping[str, Any], order: list[str]) -> dict[str, NDArray[np.float64]]:
    """Points in this order, so that their values are an array as trackers answer it."""
    places = {name: named.get(name) for name in order}
    return {name: np.full(3, np.nan) if at is None else np.array(at, np.float64) for name, at in places.items()}
