"""Runs and their measures: evaluating estimates."""

from __future__ import annotations

import html
import json
import math
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Named, described, numbers, unmasked
from .benchmark_set import Arrays, Set, Truth
from .camera import Camera
from .errors import InputError, MisreadWarning, MissingPackageError, imported, reading
from .executable import call, call_for_path, in_python, options, toml
from .paths import PathName, absolute, place
from .tracking import KEYS, one_kind, pose_of

if TYPE_CHECKING:
    import pandas
    from typing_extensions import Unpack

Units = Literal["m", "cm", "mm", "in", "ft"]


class Metrics(Named[float]):
    """Numbers by the name of a metric, which states the unit; an unknown name is answered with similar ones."""


class Folder:
    """A folder that the program wrote, with its absolute ``path``; a temporary one lives as long as this object."""

    def __init__(self, path: PathName, keep: object = None) -> None:
        self.path = absolute(path, type(self).__name__)
        self._keep = keep

    def __fspath__(self) -> str:
        return str(self.path)

    def _json(self, name: str) -> dict[str, Any]:
        with self._reading(name):
            found: dict[str, Any] = json.loads((self.path / name).read_text(encoding="utf-8"))
            if not isinstance(found, dict):
                raise TypeError(f"it holds {type(found).__name__} in place of an object")
        return found

    def _reading(self, name: str) -> AbstractContextManager[None]:
        measure = f"remove it if it is there, and measure again: skiagraph.Run({str(self.path)!r}, set).evaluate()"
        advice = "run the tracker again" if name == "program.json" else measure
        return reading(self.path / name, "a file that skiagraph wrote", advice)


class Run(Folder):
    """The estimates of one tracker on one set. ``run.evaluate()`` compares them with the truth.

    A run that is read again from its folder does not know its set: ``Run("runs/mine", "sets/walk")``.
    """

    def __init__(self, path: PathName, of: Set | PathName | None = None, keep: object = None) -> None:
        super().__init__(path, keep)
        self.set = of if of is None or isinstance(of, Set) else Set(of)
        if not any((self.path / name).exists() for name in ("track.json", "program.json", "run.json", "poses.npz")):
            lack = "it has no files of one" if self.path.is_dir() else "there is no such folder"
            raise InputError(f"{self.path}: expected the folder of a run, but {lack}")
        self._opened = self._tracked()

    def _tracked(self) -> list[int]:
        files = (self.path / name for name in ("program.json", "track.json"))
        return [file.stat().st_mtime_ns for file in files if file.exists()]

    def __fspath__(self) -> str:
        # what was read of a run is not mixed with another one in its folder
        if self.path.is_dir() and self._tracked() != self._opened:
            raise InputError(f"{self.path} was tracked again since this run was opened; open it anew: Run(path, set)")
        return super().__fspath__()

    def __repr__(self) -> str:
        if self.program is None:
            return f"Run({str(self.path)!r})"
        answers = ", ".join(f"{count} {kind}" for kind, count in self.program["answers"].items())
        return f"Run({str(self.path)!r}: {answers})"

    @cached_property
    def program(self) -> dict[str, Any] | Any:
        """The record of a tracker of yours: name, answers, incidents, times (``program.json``); None of skiagraph's."""
        if self.path.is_dir() and not (self.path / "program.json").exists():
            return None
        found = self._json("program.json")
        with self._reading("program.json"):
            dict(found["answers"]), list(found["incidents"])
        return found

    @property
    def incidents(self) -> list[dict[str, Any]]:
        """What went wrong in the tracker, with the last lines of its standard error; nothing in those of skiagraph."""
        return [] if self.program is None else cast("list[dict[str, Any]]", self.program["incidents"])

    @cached_property
    def estimate(self) -> Named[NDArray[Any]]:
        """The arrays of ``poses.npz``: ``estimate_markers`` (seeds, frames, markers, 3) and so on."""
        return Named(Arrays(Path(self) / "poses.npz"), "array")

    def evaluate(self, **options: Unpack[Reading]) -> Result:
        """Measures the run against the truth of its set, as ``set.evaluate(run)``, unless that was done.

        Raises:
            InputError: the set is not known, has no truth or is not that of the run; or, without the set, the run is
                not measured or was changed.
        """
        if self.set is not None:
            if options:
                return evaluate(self.set, self, **options)
            # what is damaged, changed or of another set is for the program to measure or refuse
            with suppress(InputError):
                result = Result(self, keep=self)
                if result.record.get("set_hash") == self.set._facts["set_hash"] and result._content("poses.npz"):
                    return result
            return evaluate(self.set, self)
        if self.path.is_dir() and not (self.path / "run.json").exists():
            raise InputError(f"{self.path} is not measured; skiagraph.Run({str(self.path)!r}, set) opens it with a set")
        result = Result(self, keep=self)
        result._content("poses.npz")
        return result


class Result(Folder):
    """The measures of a run or of another program's estimates: ``print(result)`` is the program's table."""

    _given: Mapping[str, Any] = {}

    def __init__(self, path: PathName, text: str = "", keep: object = None) -> None:
        super().__init__(path, keep)
        self._text = text
        #: Everything, as in ``run.json``, unchangeable; read at once, as the folder may be given to other results.
        self.record = self._json("run.json")
        self._listed: list[str] = []
        with suppress(OSError):
            self._listed = (self.path / "skiagraph.sha256").read_text("utf-8", "replace").splitlines()
        with self._reading("run.json"):
            # what is damaged is said here, not where it is used
            for name in ("metrics", "intervals", "absent", "hint", "grade", "report"):
                getattr(self, name)
            self.record["seeds"], self.record["frames"], self.record["per_frame"]
            if not isinstance(self.record["verdict"]["line"], str):
                raise TypeError("its verdict has no line")
        self.record = json.loads(json.dumps(self.record), object_hook=Named)

    def _content(self, name: str) -> bytes:
        from hashlib import sha256

        advice = f"use what skiagraph.Run({str(self.path)!r}, set).evaluate() returns"
        with reading(self.path / name, "a file of these results", advice):
            found = (self.path / name).read_bytes()
            # a file that the program wrote twice is listed twice
            if self._listed and f"{sha256(found).hexdigest()}  {name}" not in self._listed:
                raise ValueError("it was changed, or replaced by other results")
            return found

    @property
    def metrics(self) -> Metrics:
        """The mean of every metric over seeds; the name states the unit. ``absent`` has the others."""
        means = {name: found["mean"] for name, found in self.record["metrics"].items()}
        return Metrics(means, "metric", self.absent)

    @property
    def intervals(self) -> Named[tuple[float, float]]:
        """95 % intervals over seeds of the metrics that have one, which needs three seeds that differ."""
        found = {name: metric["ci95"] for name, metric in self.record["metrics"].items()}
        known = {name: (ends[0], ends[1]) for name, ends in found.items() if ends is not None}
        return Named(known, "interval", dict.fromkeys(found.keys() - known, "needs three seeds that differ"))

    @property
    def absent(self) -> dict[str, str]:
        """What each metric that could not be computed needs."""
        return cast("dict[str, str]", self.record["absent"])

    @property
    def hint(self) -> str | None:
        """How the estimate may have been misread: axes, units, sides, frames, origin or names; and what to do."""
        found = self.record.get("hint")
        return in_python(str(found["text"])) if found else None

    @property
    def corrections(self) -> dict[str, Any]:
        """The keywords that read the estimate as the hint says: ``evaluate(set, estimate, **result.corrections)``.

        They are those that were given, as ``names``, with what the hint changes; its offset and shift replace yours.
        Results that were opened from their folder do not know what was given.
        """
        found = self.record.get("hint") or {}
        words = (option.partition(" ") for option in found.get("options", []))
        without = [option[2:].replace("-", "_") for option in found.get("without", [])]
        without += ["out", "force", "progress"]
        listed = {name: value for name, value in self._given.items() if name not in without}
        listed |= {name[2:].replace("-", "_"): value or True for name, _, value in words}
        if isinstance(offset := listed.get("offset"), str):
            listed["offset"] = tuple(map(float, offset.split(",")))
        if "shift" in listed:
            listed["shift"] = int(listed["shift"])
        return listed | ({"joint_map": found["joint_map"]} if found.get("joint_map") else {})

    @property
    def grade(self) -> str | None:
        """good, fair or poor, None of a recording; ``record["verdict"]["rows"]`` has the limits."""
        return cast("str | None", self.record["verdict"].get("grade"))

    @property
    def report(self) -> Path:
        """The page with every frame."""
        return self.path / str(self.record["report"])

    @cached_property
    def per_frame(self) -> Named[NDArray[np.float64]]:
        """Every number by frame (seeds, frames); NaN where there is none."""
        import csv

        with self._reading(str(self.record.get("per_frame"))):
            header, *rows = csv.reader(self._content(self.record["per_frame"]).decode().splitlines())
            shape = (len(self.record["seeds"]), self.record["frames"])
            columns = zip(header, zip(*rows, strict=True), strict=True)
            found = ((name, column) for name, column in columns if name not in ("clip", "seed", "frame"))
            cells = {name: np.array([float(cell or "nan") for cell in column]) for name, column in found}
            return Named({name: column.reshape(shape) for name, column in cells.items()}, "metric by frame")

    @property
    def per_joint(self) -> Named[NDArray[np.float64]]:
        """Mean error of every marker, millimetres (seeds,), by its name; NaN without estimate."""
        with self._reading("run.json"):
            joints = self.record["per_joint"]
            return Named({joint["joint"]: np.array(joint["per_run"], np.float64) for joint in joints}, "marker")

    def to_frame(self, of: str = "metrics") -> pandas.DataFrame:
        """A DataFrame; needs pandas. ``"metrics"`` has a row for every metric, with mean, ci95, coverage, unit and so
        on; ``"per_joint"`` one for every marker, with mean_mm; ``"per_frame"`` one for every seed and frame.
        """
        frames = imported("pandas", "to_frame")
        if of == "per_frame":
            seeds = np.repeat(self.record["seeds"], self.record["frames"])
            numbers = np.tile(np.arange(self.record["frames"]), len(self.record["seeds"]))
            columns = {name: values.ravel() for name, values in self.per_frame.items()}
            table = frames.DataFrame({"seed": seeds, "frame": numbers, **columns}).set_index(["seed", "frame"])
        elif of == "per_joint":
            table = frames.DataFrame.from_records(self.record["per_joint"], index="joint")
        elif of == "metrics":
            table = frames.DataFrame.from_dict(self.record["metrics"], orient="index")
        else:
            raise InputError(f"expected metrics, per_joint or per_frame, found {of!r:.80}")
        return cast("pandas.DataFrame", table)

    def __str__(self) -> str:
        if not self._text and self._content("run.json"):
            self._text = call(["evaluate", self.path, self.path, "--stored"])[1].rstrip()
        return in_python(self._text)

    def __repr__(self) -> str:
        return f"Result({str(self.path)!r}: {self.record['verdict']['line']})"

    def _repr_html_(self) -> str:
        import base64
        import io

        table, name = preformatted(str(self)), "contact_sheet.png"
        if not (self.path / name).exists():
            return table
        sheet, kind = self._content(name), "png"
        with suppress(MissingPackageError):
            small = imported("PIL.Image", "_repr_html_", "pillow").open(io.BytesIO(sheet))
            small.thumbnail((1200, 4800))
            small.save(file := io.BytesIO(), "JPEG", quality=60)
            sheet, kind = file.getvalue(), "jpeg"
        source = f"data:image/{kind};base64,{base64.b64encode(sheet).decode()}"
        return f'{table}<img style="max-width:100%" alt="frames in all cameras" src="{source}">'


class Reading(TypedDict, total=False):
    """The options of :func:`evaluate`, for type checkers."""

    pipeline: str | None
    units: Units | None
    up: Literal["y", "z"] | None
    axes: str | None
    angles: Literal["rad", "deg"] | None
    swap_sides: bool
    shift: int | None
    offset: Sequence[float] | NDArray[np.float64] | None
    camera: str | int | Camera | None
    joint_map: Mapping[str, str] | PathName | None
    reference: PathName | None
    reference_offset: float | None
    leave_one_out: bool
    out: PathName | None
    force: bool
    progress: bool


_PLAIN = ("units", "up", "axes", "angles", "swap_sides", "shift", "force", "leave_one_out", "reference_offset")


def evaluate(
    of: Set | PathName,
    estimate: PathName | Run | ArrayLike | Mapping[Any, Any] | Sequence[Any],
    names: Sequence[str] | None = None,
    **how: Unpack[Reading],
) -> Result:
    """Measures an estimate against the truth of a set, as ``skiagraph evaluate`` does.

    Args:
        estimate: a run; a file (``.npz``, ``.csv``, ``.trc``, ``.c3d``, ``.bvh``); an array
            (frames, points, 3) or (seeds, frames, points, 3), metres, NaN or masked where there is no estimate; a
            dictionary of such points by name, each (frames, 3); what a tracker answers by the number of the frame, or
            in a list for all frames (frames without an answer are lost); or a dictionary of the arrays of an ``.npz``
            (docs/estimates.md).
        names: the points of an array; by default the set's markers, in the order of ``truth.marker_names``.
        pipeline: the program that wrote the file, ``"pose2sim"`` for example, whose axes and names are then known.
        units, up, axes, angles, swap_sides, shift, offset, camera, joint_map: how the estimate is read
            (docs/estimates.md).
        reference, reference_offset, leave_one_out: for recordings (docs/recordings.md); numbers are in ``record``.
        out: folder of the results; by default that of the run or beside the file, and a temporary one for arrays.
        force: replace results in `out`; output of another command is moved aside, to OUT~.

    Raises:
        InputError: the estimate has the wrong shape, type, names or unit, or `out` has results; the message says what
            is expected.

    Warns:
        MisreadWarning: the estimate would fit with other units, axes, names and so on; or a part of it was not used.
    """
    of = of if isinstance(of, Set) else Set(of)
    of._check_same()
    if isinstance(estimate, (Set, Truth)):
        found = "a set" if isinstance(estimate, Set) else "the truth of a set"
        raise InputError(f"expected an estimate, found {found}; its markers are set.truth.markers")
    if unknown := sorted(how.keys() - Reading.__annotations__.keys()):
        raise TypeError(f"evaluate() got an unexpected keyword argument {unknown[0]!r}")
    names = None if names is None else _checked_names(names)
    given = {name: value for name, value in {"names": names, **how}.items() if value is not None and value is not False}
    out, joint_map, force = how.get("out"), how.get("joint_map"), how.get("force", False)
    if isinstance(estimate, (list, tuple)) and any(isinstance(answer, Mapping | None) for answer in estimate):
        if len(estimate) != of.frames:
            raise InputError(f"expected answers to {of.frames} frames, found {len(estimate)}; None is a lost frame")
        estimate = dict(enumerate(estimate))
    if names is not None and isinstance(estimate, (str, PathLike, Mapping)):
        own = "a run, a file, a dictionary and answers by frame have their own (joint_map renames them)"
        raise InputError(f"names are those of an array's points; {own}; in an array, a lost frame is NaN")
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="skiagraph-") as room:
        keep: object = None
        if isinstance(estimate, (str, PathLike)):
            file = absolute(estimate, "estimate")
            if out is not None:
                place(out, "", force=force)
            keep = estimate
        else:
            arrays = _arrays(of, estimate, names)
            points = [arrays[kind] for kind in ("estimate_markers", "estimate_joints") if kind in arrays]
            if points and not any(np.nan_to_num(each).any() for each in points):
                raise InputError("there is no estimate: every point is NaN or (0, 0, 0), which counts as missing too")
            np.savez(file := Path(room) / "array.npz", **arrays)
            out, keep = place(out, "array", force=force)
        if isinstance(joint_map, Mapping):
            lines = (f"{toml(theirs)} = {toml(ours)}\n" for theirs, ours in joint_map.items())
            joint_map = Path(room) / "joints.toml"
            joint_map.write_text("".join(lines), encoding="utf-8")
        words = options(**{name: how.get(name) for name in _PLAIN}, **{"from": how.get("pipeline")})
        if (offset := how.get("offset")) is not None:
            metres = numbers(offset, "offset as three numbers in metres").ravel().tolist()
            words += options(offset=",".join(map(repr, metres)))
        camera = how.get("camera")
        words += options(camera=None if camera is None else of.camera(of._index(camera)).name, truth=of._truth_at)
        paths = {"out": out, "joint_map": joint_map, "reference": how.get("reference")}
        words += options(**{name: absolute(path, name) for name, path in paths.items() if path is not None})
        # a file of ours is named without its temporary folder, so that the same call replaces its own results
        named = file.name if file.parent == Path(room) else file
        arguments = ["evaluate", of.path, named, *words]
        text, path, notes = call_for_path(arguments, progress=how.get("progress", False), cwd=room)
    # the last paragraph is the path for people, which would name a temporary folder
    result = Result(path, text.rpartition("\n\n")[0], keep)
    result._given = given
    if result.hint:
        hint = result.record["hint"]
        is_keywords = any(hint.get(of) for of in ("options", "without", "joint_map"))
        remedy = "; set.evaluate(estimate, **result.corrections) does that" if is_keywords else ""
        notes = [f"the estimate may have been misread: {result.hint}{remedy}"]
    elif isinstance(estimate, Mapping) and 0 not in estimate and {1, of.frames - 1} <= estimate.keys():
        notes.append("there is no answer to frame 0: frames count from 0, as frame.index does")
    elif isinstance(estimate, Mapping) and [at for at in estimate if estimate[at] is not None] == [0]:
        notes.append("only frame 0 is answered, whose pose trackers are given: it is not measured")
    level = 1
    while sys._getframe(level).f_globals.get("__package__") == __package__:
        level += 1
    for note in notes:
        warnings.warn(note, MisreadWarning, level + 1)
    return result


def _checked_names(names: Any) -> list[str]:
    if isinstance(names, Iterable) and not isinstance(names, str | set | frozenset):
        listed = list(names)
        if all(isinstance(name, str) for name in listed):
            return listed
    raise InputError(f"expected names=[...] of text, one for each point, found {type(names).__name__} {names!r:.80}")


def _arrays(of: Set, estimate: Any, names: Sequence[str] | None) -> dict[str, Any]:
    if isinstance(estimate, Mapping):
        estimate = _by_name(of, estimate)
        are_names = all(isinstance(name, str) and not name.isdecimal() for name in estimate)
        if not are_names or any(isinstance(at, Mapping | None) for at in estimate.values()):
            return _by_frame(of, estimate)
        if any(str(name).startswith("estimate_") for name in estimate):
            arrays = {str(name): _array_of_file(str(name), values) for name, values in estimate.items()}
            return {"fps": np.float64(of.fps), **arrays}
        names = [str(name) for name in estimate]
        estimate = _stacked(of, estimate)
    markers = list(of.marker_names)
    names = markers if names is None else list(names)
    expected = f"({of.frames}, {len(names)}, 3) or (seeds, {of.frames}, {len(names)}, 3)"
    points = numbers(estimate, f"numbers of shape {expected}")
    if points.ndim not in (3, 4) or points.shape[-2:] != (len(names), 3):
        found = f"{described(estimate, points)}; other points need names=[...]"
        raise InputError(f"expected an array {expected} of {len(names)} points ({', '.join(names)}), found {found}")
    joints = set(of.joint_names) - set(markers)
    is_joints = set(names) <= joints
    if not is_joints and set(names) & joints and set(names) & set(markers):
        expected = f"expected names of markers ({', '.join(markers)}) or of joints (set.joint_names)"
        raise InputError(f"{expected}, found names of both; docs/estimates.md has arrays of both")
    key, key_names = ("estimate_joints", "estimate_joint_names") if is_joints else ("estimate_markers", "marker_names")
    points = points if points.ndim == 4 else points[None]
    seeds = np.arange(len(points))
    return {"fps": of.fps, "seeds": seeds, key: points, key_names: np.array(names)}


def _by_name(of: Set, answers: Mapping[Any, Any]) -> Mapping[Any, Any]:
    """Points of other names by frame, such as a detector's, as stacks by name; own names, one misspelt, as they are."""
    frames = [{} if (answer := answers.get(frame)) is None else answer for frame in range(of.frames)]
    if len(answers) > of.frames or not all(isinstance(frame, Mapping) for frame in frames):
        return answers
    own = {*of.info.markers, *of.info.joints}
    names = dict.fromkeys(str(name) for frame in frames for name in frame)
    are_other = 10 * len(names.keys() - own) > len(names) and not names.keys() & KEYS
    if not are_other or not set(answers) <= set(range(of.frames)):
        return answers
    return {name: [frame.get(name, (math.nan,) * 3) for frame in frames] for name in names}


def _by_frame(of: Set, answers: Mapping[Any, Any]) -> dict[str, Any]:
    poses: dict[int, dict[str, Any]] = {}
    kind = ""
    for frame, answer in answers.items():
        if not isinstance(frame, (int, np.integer)) or isinstance(frame, bool) or not 0 <= frame < of.frames:
            wanted = f"answers by the indices of frames, {{frame.index: answer}}, integers 0 to {of.frames - 1}"
            raise InputError(f"expected {wanted}, found the key {frame!r:.80}")
        try:
            poses[int(frame)] = {} if answer is None else pose_of(answer, of.info)
            kind = one_kind(poses[int(frame)], kind)
        except InputError as error:
            raise InputError(f"the answer to frame {frame}: {error}") from None
    names = {
        "markers": ("marker_names", of.info.markers),
        "joints": ("estimate_joint_names", of.info.joints),
        "angles": ("estimate_angle_names", of.info.angles),
    }
    arrays: dict[str, NDArray[Any]] = {}
    for frame, pose in poses.items():
        for key, part in pose.items():
            if key == "confidence" or part is None:
                continue
            rows = part if kind == "root and angles" else [part.get(name) or [np.nan] * 3 for name in names[key][1]]
            shape = (1, of.frames, *np.shape(rows))
            arrays.setdefault(f"estimate_{key}", np.full(shape, np.nan))[0, frame] = rows
    if not arrays:
        raise InputError("expected an answer to at least one frame, found none")
    # names without their array would be renamed too
    return {"fps": of.fps, **arrays, **dict(names[key] for key in names if f"estimate_{key}" in arrays)}


def _array_of_file(name: str, values: Any) -> NDArray[Any]:
    """An array as the program reads it: numbers of 64 bits; names, seeds and switches as they are."""
    array = unmasked(values)
    if array.dtype == object:
        raise InputError(f"{name}: expected numbers or names, found {described(values, array)}")
    if not name.startswith("estimate_") or array.dtype.kind in "UbS":
        return array
    return numbers(array, f"{name} as numbers")


def _stacked(of: Set, named: Mapping[Any, ArrayLike]) -> NDArray[Any]:
    arrays = {name: numbers(points, f"numbers of {name!r}") for name, points in named.items()}
    for name, points in arrays.items():
        if points.ndim < 2 or points.shape[-1] != 3 or points.shape != next(iter(arrays.values())).shape:
            expected = f"expected every point as an array ({of.frames}, 3) or (seeds, {of.frames}, 3)"
            raise InputError(f"{expected}, found {name!r} of shape {points.shape}")
    if not arrays:
        raise InputError("expected points by name, or {frame.index: answer, ...}, found an empty dictionary")
    return np.stack(list(arrays.values()), axis=-2)


class Table:
    """A table of the program, which ``print`` and notebooks show; ``record`` is everything, as ``--json`` prints it."""

    def __init__(self, record: dict[str, Any], text: str) -> None:
        self.record, self._text = record, text

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return preformatted(self._text)


def preformatted(text: str) -> str:
    """HTML of a table of the program."""
    return f"<pre>{html.escape(text)}</pre>"
