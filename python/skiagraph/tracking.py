"""Trackers written in Python: what they are given, what they answer, and the loop that serves them."""

from __future__ import annotations

import contextlib
import functools
import inspect
import json
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from .arrays import Fixed, Named, described, numbers
from .camera import Camera
from .errors import InputError, TrackerError, reading
from .images import picture, silhouette

#: What ``track`` may return: None for a lost frame; an array (points, 3) of all markers or all joints in the order of
#: :class:`SetInfo`; a dictionary of points by name, of markers or of joints; or a dictionary with the keys of an answer
#: of the protocol: ``markers``, ``joints``, or ``root`` and ``angles``, with or without ``confidence``. Metres and
#: radians in the world.
Answer: TypeAlias = Any


class Tracker(Protocol):
    """A tracker with a state; its method ``start(info)``, if it has one, is called before the first frame of a seed."""

    def track(self, frame: Frame) -> Answer:
        """The estimate of one frame."""


#: A tracker: an object, a class without arguments (one object for every seed), or a function of a frame.
AnyTracker: TypeAlias = Tracker | type[Tracker] | Callable[["Frame"], Answer]


@dataclass(frozen=True, eq=False)
class Start(Fixed):
    """The pose of the tracker's own body in frame 0. Its arrays cannot be changed in place.

    ``root`` is x y z qw qx qy qz of the root in the world, metres (7,); ``angles`` are radians (n,), of
    ``angle_names``; ``markers`` and ``joints`` are points by name, metres (3,), NaN for those that the body lacks.
    """

    _arrays = ("root", "angles")

    root: NDArray[np.float64]
    angles: NDArray[np.float64]
    angle_names: tuple[str, ...]
    markers: Named[NDArray[np.float64]]
    joints: Named[NDArray[np.float64]]


class SetInfo:
    """What a tracker is told before the first frame.

    ``seed``; ``frames``, their number; ``fps``, frames a second; ``cameras``, those that move as they are in frame 0;
    ``markers``, ``joints`` and ``angles``, names in the order of arrays; ``keypoints``, names of those of a
    :class:`View`, if any; ``backgrounds``, paths of images without people by camera, if any; ``folder``, with all files
    that trackers may read; ``first_frame``, above 0 if a program was started again; ``message``, all in the protocol.
    """

    def __init__(self, hello: Mapping[str, Any]) -> None:
        self.message = hello
        self.seed: int = hello["seed"]
        self.frames: int = hello["frames"]
        self.fps: float = hello["fps"]
        self.cameras: tuple[Camera, ...] = tuple(map(Camera.from_record, hello["cameras"]))
        self.markers: tuple[str, ...] = tuple(hello["markers"])
        self.joints: tuple[str, ...] = tuple(hello["joints"])
        self.angles: tuple[str, ...] = tuple(hello["angles"])
        self.keypoints: tuple[str, ...] = tuple(hello.get("keypoints", {}).get("names", ()))
        paths = {record["name"]: tuple(map(Path, record.get("background", ()))) for record in hello["cameras"]}
        self.backgrounds: Named[tuple[Path, ...]] = Named(paths, "camera")
        self.folder = Path(hello["folder"])
        self.first_frame: int = hello.get("first_frame", 0)

    def __repr__(self) -> str:
        return f"SetInfo({self.frames} frames at {self.fps:g} Hz, {len(self.cameras)} cameras, seed {self.seed})"

    @cached_property
    def start(self) -> Start:
        """The pose of the tracker's body in frame 0."""
        found = self.message["start"]
        markers = _points("marker", found["markers"], self.markers)
        joints = _points("joint", found["joints"], self.joints)
        return Start(found["root"], found["angles"], self.angles, markers, joints)


class View:
    """What one camera saw of a frame."""

    def __init__(self, message: Mapping[str, Any], camera: Camera) -> None:
        self._message, self._camera = message, camera

    def __repr__(self) -> str:
        return f"View({self._camera.name})"

    @cached_property
    def camera(self) -> Camera:
        """The camera; where it was for this image, if it moves."""
        if "R" not in self._message:
            return self._camera
        return replace(self._camera, R=np.array(self._message["R"]), t=np.array(self._message["t"]))

    @cached_property
    def mask(self) -> NDArray[np.bool_] | Any:
        """The silhouette (height, width); None if the camera took no image for this frame. Read lazily."""
        if (path := self._message.get("mask")) is not None:
            return silhouette(content(path), path)
        if (lengths := self._message.get("rle")) is not None:
            values = np.arange(len(lengths)) % 2 == 1
            return np.repeat(values, lengths).reshape(self._camera.height, self._camera.width)
        return None

    @cached_property
    def image(self) -> NDArray[np.uint8] | Any:
        """What the camera saw (height, width, 3), red first, or (height, width) if it is grey. Read lazily.

        None if the set has no images, or the camera took none for this frame.
        """
        path = self._message.get("colour")
        return None if path is None else picture(content(path), path)

    @cached_property
    def keypoints(self) -> NDArray[np.float64] | Any:
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
    """One frame as a tracker sees it: ``index``, from 0, and ``time``, seconds from frame 0, whose pose is wanted."""

    def __init__(
        self, message: Mapping[str, Any], info: SetInfo | Callable[[], SetInfo], cameras: Sequence[Camera] | None = None
    ) -> None:
        self.index: int = message["frame"]
        self.time: float = message["time_s"]
        self._message, self._info, self._cameras = message, info, cameras

    def __repr__(self) -> str:
        return f"Frame({self.index}, {self.time:.3f} s)"

    @property
    def info(self) -> SetInfo:
        """What is known of the set."""
        return self._info() if callable(self._info) else self._info

    @cached_property
    def views(self) -> list[View]:
        """What every camera saw, in the order of the set's cameras."""
        pairs = zip(self._message["views"], self._cameras or self.info.cameras, strict=True)
        return [View(message, camera) for message, camera in pairs]

    @property
    def masks(self) -> list[NDArray[np.bool_] | Any]:
        """The silhouettes of all cameras, bool (height, width); None for a camera that took no image."""
        return [view.mask for view in self.views]

    @property
    def mask_array(self) -> NDArray[np.bool_]:
        """The silhouettes of all cameras, bool (cameras, height, width); empty where a camera took no image."""
        sizes = {(view.camera.height, view.camera.width) for view in self.views}
        if len(sizes) > 1:
            raise InputError("the cameras have images of several sizes, which are no array; use frame.masks")
        array = np.zeros((len(self.views), *sizes.pop()), np.bool_)
        for place, view in zip(array, self.views, strict=True):
            if view.mask is not None:
                place[:] = view.mask
        return array


def content(path: str | Path) -> bytes:
    """The bytes of a file of a set."""
    with reading(path, "a file of a set"):
        return Path(path).read_bytes()


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
    kept: dict[int, Callable[[Frame], Answer]] | None = None,
) -> None:
    """Answers the requests of one seed; the tracker in `kept`, by its seed, goes on after a late answer."""

    def say(message: Mapping[str, Any]) -> None:
        answers.write(json.dumps(message) + "\n")
        answers.flush()

    info, track, kind = None, _track_of(tracker), ""
    for line in requests:
        message = json.loads(line)
        if message["type"] == "hello":
            info = SetInfo(message)
            begun = kept.get(info.seed) if kept is not None and info.first_frame else None
            track = _started(tracker, info) if begun is None else begun
            if kept is not None:
                kept.clear()
                kept[info.seed] = track
            say({"type": "ready", "name": name or name_of(tracker), "protocol": message["protocol"]})
        elif message["type"] == "frame" and info is not None:
            frame, begin = Frame(message, info), time.monotonic()
            try:
                estimate = track(frame)
            except Exception as error:
                raise _raised(info, f"in frame {frame.index}", error) from error
            reply, kind = message_of(estimate, frame, kind)
            say(reply)
            if kept is not None and (took := time.monotonic() - begin) > (limit := info.message["time_limit_s"]):
                slow = f"frame {frame.index} of seed {info.seed} took {took:.3g} s, and frame_limit is {limit:g}"
                warnings.warn(f"{slow}: its answer came too late and is lost", RuntimeWarning, 2)
            if on_frame is not None:
                on_frame(frame)
        elif message["type"] == "end":
            return


def name_of(tracker: object) -> str:
    """The name of a tracker's class or function; that of a lambda has its line."""
    while isinstance(tracker, functools.partial):
        tracker = tracker.func
    named: Any = tracker if hasattr(tracker, "__name__") else type(tracker)
    name = str(getattr(named, "__name__", "tracker"))
    code = getattr(inspect.unwrap(named), "__code__", None)
    return name if name != "<lambda>" or code is None else f"lambda_{code.co_firstlineno}"


def _track_of(tracker: Any) -> Callable[[Frame], Answer]:
    track: Callable[[Frame], Answer] | None = getattr(tracker, "track", None if inspect.isclass(tracker) else tracker)
    if track is not None and callable(track):
        return track
    expected = "a function of a frame, or an object or class with a method track(frame)"
    raise TrackerError(f"expected {expected}, found {tracker!r}")


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


def one_kind(pose: Mapping[str, Any], earlier: str) -> str:
    """What answers consist of, if this one is as earlier ones are; empty as long as all frames are lost."""
    kind = next((kind for key, kind in _KINDS.items() if pose.get(key)), "")
    if kind and earlier and kind != earlier:
        raise InputError(f"expected {earlier}, as in earlier frames, found {kind}; answer all frames in one form")
    return earlier or kind


def message_of(estimate: Answer, frame: Frame, kind: str) -> tuple[dict[str, Any], str]:
    """The message of an answer, and of what kind answers are."""
    if estimate is None:
        return {"type": "lost", "frame": frame.index}, kind
    try:
        pose = pose_of(estimate, frame.info)
        points = pose.get("markers") or pose.get("joints") or {"root": pose.get("root")}
        if not any(points.values()):
            return {"type": "lost", "frame": frame.index}, kind
        # frame 0 is often answered by the start pose as it was given
        if not kind or frame.index == 1:
            _expect_metres(pose, frame.info.start)
        kind = one_kind(pose, kind)
    except (TypeError, ValueError) as error:
        raise TrackerError(f"the answer to frame {frame.index} of seed {frame.info.seed}: {error}") from error
    return {"type": "pose", "frame": frame.index, **pose}, kind


#: How many times larger than the start pose the points of the first two answers may be, as in ``skiagraph evaluate``.
_TOO_LARGE = 5


def _expect_metres(pose: Mapping[str, Any], start: Start) -> None:
    for kind, places in (("markers", start.markers), ("joints", start.joints)):
        answered = {name: at for name, at in (pose.get(kind) or {}).items() if at is not None}
        known = [name for name in answered if np.isfinite(places[name]).all()]
        if len(known) < 2:
            continue
        found, usual = (float(np.ptp([of[name] for name in known], axis=0).max()) for of in (answered, places))
        if usual > 0 and (times := found / usual) > _TOO_LARGE:
            units = {1000: "millimetres", 100: "centimetres", 39.4: "inches"}
            factor = min(units, key=lambda unit: abs(np.log(times / unit)))
            much = f"its body has {times:.0f} times the size of the start pose"
            raise InputError(f"{much}: expected metres, it seems to be in {units[factor]}; divide it by {factor}")


def pose_of(estimate: Answer, info: SetInfo) -> dict[str, Any]:
    """What a tracker may answer, as the protocol says it: points by name, or root and angles, with None for missing."""
    if not isinstance(estimate, Mapping):
        return _pose_of_array(estimate, info)
    names = set(estimate)
    if not names:
        raise InputError("expected points by name, found an empty dictionary; return None for a lost frame")
    if names <= KEYS:
        return _pose_of_keys(estimate, info)
    for kind, known in (("markers", info.markers), ("joints", info.joints)):
        if names <= set(known):
            return {kind: _places(estimate, kind, known)}
    unknown = sorted(map(str, names - set(info.markers) - set(info.joints)))
    found = ", ".join(unknown[:3]) + (f" and {len(unknown) - 3} more" if len(unknown) > 3 else "")
    found = f"{found or 'names of both'}; set.evaluate({{frame.index: answer, ...}}) measures points of other names"
    raise InputError(f"expected names of markers ({', '.join(info.markers)}) or of info.joints, found {found}")


#: Greatest deviation of a quaternion's length from 1, and greatest coordinate in metres, that the program accepts.
_LONGEST_ERROR, _FARTHEST_M = 1e-3, 1e6

#: Keys of an answer in the protocol, and kinds of answers by one of their keys.
KEYS = frozenset({"markers", "joints", "root", "angles", "confidence"})
_KINDS = {"markers": "markers", "joints": "joints", "root": "root and angles"}


def _pose_of_keys(answer: Mapping[str, Any], info: SetInfo) -> dict[str, Any]:
    confidence = answer.get("confidence")
    parts: dict[str, Any] = {key: value for key, value in answer.items() if key != "confidence"}
    if set(parts) not in ({"markers"}, {"joints"}, {"root", "angles"}):
        found = " and ".join(sorted(parts)) or "confidence alone"
        raise InputError(f"expected a dictionary with markers, or joints, or both root and angles, found {found}")
    for kind, known in (("markers", info.markers), ("joints", info.joints)):
        if kind in parts:
            parts[kind] = _places(parts[kind], kind, known)
    if "root" in parts:
        angles = parts["angles"]
        if isinstance(angles, Mapping):
            missing, unknown = sorted(set(info.angles) - set(angles)), sorted(map(str, set(angles) - set(info.angles)))
            if missing or unknown:
                raise InputError(f"angles: expected all of info.angles; missing: {missing}, unknown: {unknown}")
            angles = [angles[name] for name in info.angles]
        parts |= {"root": _row(parts["root"], "root", 7), "angles": _row(angles, "angles", len(info.angles))}
        if parts["root"] is not None and abs(np.linalg.norm(parts["root"][3:]) - 1) > _LONGEST_ERROR:
            raise InputError(f"root: expected x, y, z and a quaternion w, x, y, z of length 1, found {parts['root']}")
        if (parts["root"] is None) != (parts["angles"] is None):
            raise InputError("only one of root and angles is NaN; expected both, or neither")
    if confidence is not None:
        number = numbers(confidence, "confidence as a number from 0 to 1")
        if number.shape != () or not 0 <= number <= 1:
            raise InputError(f"confidence is {confidence!r:.80}; expected a number from 0 to 1")
        parts["confidence"] = float(number)
    return parts


def _pose_of_array(estimate: Answer, info: SetInfo) -> dict[str, Any]:
    kinds = {"markers": info.markers, "joints": info.joints}
    wanted = " or ".join(f"({len(names)}, 3) of {kind}" for kind, names in kinds.items())
    wanted = f"None, a dictionary, or numbers of shape {wanted}, in metres"
    array = numbers(estimate, wanted)
    fitting = {kind: names for kind, names in kinds.items() if array.shape == (len(names), 3)}
    if len(fitting) != 1:
        ambiguous = "; as both are as many, return {'markers': ...} or {'joints': ...}" if fitting else ""
        raise InputError(f"expected {wanted}, found {described(estimate, array)}{ambiguous}")
    ((kind, names),) = fitting.items()
    return {kind: _places(array, kind, names)}


def _places(points: Any, kind: str, known: Sequence[str]) -> dict[str, list[float] | None]:
    """Points by name, of a dictionary or of an array in the order of the known names; None for missing ones."""
    if isinstance(points, Mapping):
        if unknown := sorted(map(str, set(points) - set(known))):
            raise InputError(f"{kind}: expected names of {', '.join(known)}, found {', '.join(unknown)}")
        return {name: None if at is None else _row(at, f"{kind} {name}", 3) for name, at in points.items()}
    array = numbers(points, f"{kind} as numbers of shape ({len(known)}, 3), or by name")
    if array.shape != (len(known), 3):
        raise InputError(f"expected {kind} of shape ({len(known)}, 3), or by name, found {described(points, array)}")
    if (np.abs(array) <= _FARTHEST_M).all():
        # in one go, as most answers are complete
        return dict(zip(known, array.tolist(), strict=True))
    return {name: _row(row, f"{kind} {name}", 3) for name, row in zip(known, array, strict=True)}


def _row(values: Any, where: str, count: int) -> list[float] | None:
    """Finite numbers; None if all of them are NaN."""
    row = numbers(values, f"{where} as {count} numbers")
    if row.shape != (count,):
        raise InputError(f"expected {where} as {count} numbers, found {described(values, row)}")
    if (np.abs(row) <= _FARTHEST_M).all():
        return cast("list[float]", row.tolist())
    if np.isnan(row).all():
        return None
    wanted = f"finite numbers up to {_FARTHEST_M:.0e}, or only NaN for a missing point"
    raise InputError(f"{where} is {row.tolist()}; expected {wanted}")


def _points(kind: str, named: Mapping[str, Any], order: Sequence[str]) -> Named[NDArray[np.float64]]:
    """Points in this order, so that their values are an array as trackers answer it."""
    places = {name: named.get(name) for name in order}
    return Named({name: np.array([np.nan] * 3 if at is None else at, float) for name, at in places.items()}, kind)
