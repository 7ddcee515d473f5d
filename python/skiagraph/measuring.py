"""Runs and their measures: evaluating estimates."""

from __future__ import annotations

import csv
import json
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import described, numbers, unmasked
from .benchmark_set import Arrays, Set
from .errors import InputError, ProgramError, imported
from .executable import call, options, toml
from .paths import PathName, absolute
from .temporary import place
from .wording import in_python

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


#: The file in which the program reads an array.
_ARRAY = "array.npz"


class Folder:
    """A folder that the program wrote; a temporary one lives as long as this object."""

    def __init__(self, path: PathName, keep: object = None) -> None:
        #: The folder, absolute.
        self.path = absolute(path, type(self).__name__)
        self._keep = keep

    def __fspath__(self) -> str:
        return str(self.path)

    def _check(self) -> None:
        if not self.path.is_dir():
            raise InputError(f"{self.path}: expected the folder of a run, but there is no such folder")

    def _json(self, name: str) -> dict[str, Any]:
        self._check()
        try:
            found: dict[str, Any] = json.loads((self.path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.path / name}: expected a file that skiagraph wrote, but {error}") from None
        return found


class Run(Folder):
    """The estimates of one tracker on one set. ``run.measure()`` compares them with the truth.

    Give ``of``, the set, to a run that is read again from its folder.
    """

    def __init__(self, path: PathName, of: Set | None = None, keep: object = None) -> None:
        super().__init__(path, keep)
        self.set = of

    def __repr__(self) -> str:
        if not (self.path / "program.json").exists():
            return f"Run({str(self.path)!r})"
        answers = ", ".join(f"{count} {kind}" for kind, count in self.program["answers"].items())
        return f"Run({str(self.path)!r}: {answers})"

    @cached_property
    def program(self) -> dict[str, Any]:
        """The record of an external tracker: name, answers, incidents, times (``program.json``)."""
        return self._json("program.json")

    @property
    def incidents(self) -> list[dict[str, Any]]:
        """What went wrong in the tracker, with the last lines of its standard error."""
        found: list[dict[str, Any]] = self.program["incidents"]
        return found

    @cached_property
    def estimate(self) -> dict[str, NDArray[Any]]:
        """The arrays of ``poses.npz``: ``estimate_markers`` (seeds, frames, markers, 3) and so on."""
        return dict(Arrays(self.path / "poses.npz"))

    def measure(self) -> Result:
        """Measures the run against the truth of its set, unless that was done.

        Raises:
            InputError: the set is not known, or has no truth.
        """
        if not (self.path / "run.json").exists():
            self._check()
            if self.set is None:
                raise InputError(f"{self.path} is not measured, and its set is not known: use set.evaluate(run)")
            return evaluate(self.set, self)
        return Result(self.path, keep=self)


class Result(Folder):
    """The measures of a run or of another program's estimates: ``print(result)`` is the program's table.

    >>> result = Set("sets/walk").evaluate(Set("sets/walk").truth.markers)
    >>> round(result.metrics["humaneva_mm"], 3)
    0.0
    >>> sorted(result.per_frame)[:2]
    ['acceleration_error_m_per_s2', 'auc150']
    """

    def __init__(self, path: PathName, text: str = "", keep: object = None) -> None:
        super().__init__(path, keep)
        self._text = in_python(text)
        #: Everything, as in ``run.json``; read at once, as the folder may be given to other results later.
        self.record = self._json("run.json")

    @property
    def metrics(self) -> dict[str, float]:
        """The mean of every metric over seeds; the name states the unit. ``absent`` has the others."""
        return {name: found["mean"] for name, found in self.record["metrics"].items()}

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals over seeds of the metrics that have one, which needs three seeds that differ."""
        found = {name: metric["ci95"] for name, metric in self.record["metrics"].items()}
        return {name: (ends[0], ends[1]) for name, ends in found.items() if ends is not None}

    @property
    def absent(self) -> dict[str, str]:
        """What each metric that could not be computed needs."""
        found: dict[str, str] = self.record["absent"]
        return found

    @property
    def hint(self) -> str | None:
        """How the estimate may have been misread: axes, units, sides, frames, origin or names."""
        found = self.record.get("hint")
        return in_python(str(found["text"])).replace(_ARRAY, "the array") if found else None

    @property
    def grade(self) -> str:
        """good, usable, poor or lost; ``record["verdict"]`` says why."""
        return str(self.record["verdict"]["grade"])

    @property
    def report(self) -> Path:
        """The page with every frame."""
        return self.path / str(self.record["report"])

    @cached_property
    def per_frame(self) -> dict[str, NDArray[np.float64]]:
        """Every number by frame (seeds, frames); NaN where there is none."""
        with (self.path / self.record["per_frame"]).open(newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
        shape = (len(self.record["seeds"]), self.record["frames"])
        columns = zip(header, zip(*rows, strict=True), strict=True)
        numbers = ((name, column) for name, column in columns if name not in ("clip", "seed", "frame"))
        return {name: np.array([float(cell or "nan") for cell in column]).reshape(shape) for name, column in numbers}

    def to_frame(self) -> pandas.DataFrame:
        """A DataFrame with a row for every metric: mean, ci95, coverage, unit, protocol and so on. Needs pandas."""
        frames = imported("pandas", "to_frame")
        table: pandas.DataFrame = frames.DataFrame.from_dict(self.record["metrics"], orient="index")
        return table

    def plot(self, metric: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draws a metric by time, one line for every seed; by default the main error. Needs matplotlib.

        Raises:
            InputError: the metric has no values by frame.
        """
        pyplot = imported("matplotlib.pyplot", "plot")
        metric = next(name for name in self.per_frame if name != "time_s") if metric is None else metric
        if not isinstance(metric, str) or metric not in self.per_frame:
            raise InputError(f"{metric!r} has no values by frame; those that have are {', '.join(self.per_frame)}")
        axes: Axes = pyplot.subplots()[1] if ax is None else ax
        for seed, values in zip(self.record["seeds"], self.per_frame[metric], strict=True):
            axes.plot(self.per_frame["time_s"][0], values, label=f"seed {seed}")
        axes.set(xlabel="time (s)", ylabel=metric)
        axes.legend()
        return axes

    def __str__(self) -> str:
        if self._text:
            return self._text
        rows = (f"  {name:36} {mean:12.4g}" for name, mean in self.metrics.items())
        return "\n".join([*rows, f"  {self.record['verdict']['line']}"])

    def __repr__(self) -> str:
        return f"Result({str(self.path)!r}: {self.record['verdict']['line']})"

    def _repr_html_(self) -> str:
        import base64

        sheet = self.path / "contact_sheet.png"
        picture = base64.b64encode(sheet.read_bytes()).decode() if sheet.exists() else ""
        image = f'<img style="max-width:100%" alt="frames in all cameras" src="data:image/png;base64,{picture}">'
        return preformatted(str(self)) + (image if picture else "")


def evaluate(
    of: Set | PathName,
    estimate: PathName | Run | ArrayLike | Mapping[str, ArrayLike],
    names: Sequence[str] | None = None,
    *,
    pipeline: str | None = None,
    units: str | None = None,
    up: str | None = None,
    axes: str | None = None,
    angles: str | None = None,
    swap_sides: bool = False,
    shift: int | None = None,
    offset: Sequence[float] | None = None,
    joint_map: Mapping[str, str] | PathName | None = None,
    model: PathName | None = None,
    out: PathName | None = None,
    force: bool = False,
    progress: bool = False,
) -> Result:
    """Measures an estimate against the truth of a set, as ``skiagraph evaluate`` does.

    Args:
        estimate: a run; a file (``.npz``, ``.csv``, ``.trc``, ``.c3d``, ``.bvh``, ``.sto``, ``.mot``); an array
            (frames, points, 3) or (seeds, frames, points, 3), metres, NaN or masked where there is no estimate; a
            dictionary of such points by name, each (frames, 3); or a dictionary of the arrays of an ``.npz``
            (docs/estimates.md).
        names: the points of an array, and of nothing else; by default the set's markers, in the order of
            ``truth.marker_names``.
        pipeline: the program that wrote the file, ``"pose2sim"`` for example, whose axes and names are then known.
        units, up, axes, angles, swap_sides, shift, offset, joint_map: how the estimate is read (docs/estimates.md).
        model: the OpenSim model whose coordinates a ``.mot`` file has.
        out: folder of the results; by default that of the run or beside the file, and a temporary one for arrays.
        force: replace results in `out`; output of another command is moved aside, to OUT~.

    Raises:
        InputError: the estimate has the wrong shape, type, names or unit, or `out` has results; the message says what
            is expected.

    >>> walk = Set("sets/walk")
    >>> points = dict(zip(walk.truth.marker_names.tolist(), walk.truth.markers.swapaxes(0, 1)))
    >>> result = evaluate(walk, {name: points[name] for name in ("left_knee", "right_knee")})
    >>> round(result.metrics["mpjpe_mm"], 3), round(result.metrics["coverage"], 3)
    (0.0, 0.133)
    """
    of = of if isinstance(of, Set) else Set(of)
    names = None if names is None else _checked_names(names)
    if names is not None and isinstance(estimate, (str, PathLike, Mapping)):
        raise InputError(
            "names are those of an array's points; a run, a file or a dictionary has its own (joint_map renames them)"
        )
    with tempfile.TemporaryDirectory(prefix="skiagraph-") as room:
        keep: object = None
        if isinstance(estimate, (str, PathLike)):
            file = absolute(estimate, "estimate")
            if out is not None:
                place(out, "", force=force)
            keep = estimate
        else:
            file = _written(of, estimate, names, Path(room) / _ARRAY)
            out, keep = place(out, "array", force=force)
        if isinstance(joint_map, Mapping):
            lines = (f"{toml(theirs)} = {toml(ours)}\n" for theirs, ours in joint_map.items())
            joint_map = Path(room) / "joints.toml"
            joint_map.write_text("".join(lines), encoding="utf-8")
        words = options(
            truth=of._truth_at,
            units=units,
            up=up,
            axes=axes,
            angles=angles,
            swap_sides=swap_sides,
            shift=shift,
            offset=None if offset is None else _metres(offset),
            joint_map=None if joint_map is None else absolute(joint_map, "joint_map"),
            model=None if model is None else absolute(model, "model"),
            out=None if out is None else absolute(out, "out"),
            force=force,
            **{"from": pipeline},
        )
        # a file of ours is named without its temporary folder, so that the same call replaces its own results
        named = file.name if file.parent == Path(room) else file
        try:
            _, text = call(["evaluate", of.path, named, *words], progress=progress, cwd=room)
        except InputError as error:
            said = str(error).replace(_ARRAY, "the array")
            if " is not a marker " in said:
                said += f"; or, for joints alone, joints of the tracker's body: {', '.join(of.joint_names)}"
            raise InputError(said, error.exit_code) from None
    table, said, report = text.rstrip().rpartition("\n\n  report: ")
    if not said:
        raise ProgramError(f"skiagraph evaluate did not say where its report is: {text}")
    return Result(Path(report).parent, table.replace(_ARRAY, "the array"), keep)


def _checked_names(names: Any) -> list[str]:
    listed = names.tolist() if isinstance(names, np.ndarray) else names
    if isinstance(listed, str) or not isinstance(listed, Iterable):
        raise InputError(f"expected names=[...], one for every point, found {type(names).__name__} {names!r:.80}")
    listed = list(listed)
    for name in listed:
        if not isinstance(name, str):
            raise InputError(f"expected names=[...] of text, found {type(name).__name__} {name!r:.80} among them")
    return listed


def _metres(offset: Sequence[float]) -> str:
    try:
        return ",".join(f"{float(part)!r}" for part in offset)
    except (TypeError, ValueError):
        raise InputError(f"offset: expected three numbers in metres, found {offset!r}") from None


def _written(of: Set, estimate: Any, names: Sequence[str] | None, to: Path) -> Path:
    if isinstance(estimate, Mapping):
        if any(str(name).startswith("estimate_") for name in estimate):
            arrays = {str(name): _array_of_file(str(name), values) for name, values in estimate.items()}
            return _saved(to, {"fps": np.float64(of.fps), **arrays})
        names = [str(name) for name in estimate]
        estimate = _stacked(of, estimate)
    markers: list[str] = of.truth.marker_names.tolist()
    names = markers if names is None else list(names)
    expected = f"({of.frames}, {len(names)}, 3) or (seeds, {of.frames}, {len(names)}, 3)"
    points = numbers(estimate, f"numbers of shape {expected}")
    if points.ndim not in (3, 4) or points.shape[-2:] != (len(names), 3):
        raise InputError(
            f"expected an array (frames, points, 3) or (seeds, frames, points, 3) with {len(names)} points "
            f"({', '.join(names)}), here {expected}, found {described(estimate, points)}; other points need names=[...]"
        )
    joints = set(of.joint_names) - set(markers)
    is_joints = set(names) <= joints
    if not is_joints and set(names) & joints and set(names) & set(markers):
        raise InputError(
            f"expected points by the names of markers ({', '.join(markers)}) or of joints of the tracker's body "
            f"({', '.join(of.joint_names)}), found names of both; give them as estimate_markers with marker_names, and "
            "estimate_joints with estimate_joint_names (docs/estimates.md)"
        )
    key, key_names = ("estimate_joints", "estimate_joint_names") if is_joints else ("estimate_markers", "marker_names")
    points = points if points.ndim == 4 else points[None]
    seeds = np.arange(len(points))
    return _saved(to, {"fps": of.fps, "seeds": seeds, key: points, key_names: np.array(names)})


def _array_of_file(name: str, values: Any) -> NDArray[Any]:
    """An array as the program reads it: numbers of 64 bits; names, seeds and switches as they are."""
    array = unmasked(values)
    if array.dtype == object:
        raise InputError(f"{name}: expected numbers or names, found {described(values, array)}")
    if not name.startswith("estimate_") or array.dtype.kind in "UbS":
        return array
    return numbers(array, f"{name} as numbers")


def _saved(to: Path, arrays: dict[str, Any]) -> Path:
    np.savez(to, **arrays)
    return to


def _stacked(of: Set, named: Mapping[Any, ArrayLike]) -> NDArray[Any]:
    arrays = {name: numbers(points, f"numbers of {name!r}") for name, points in named.items()}
    for name, points in arrays.items():
        if points.ndim < 2 or points.shape[-1] != 3 or points.shape != next(iter(arrays.values())).shape:
            first = next(iter(arrays))
            raise InputError(
                f"expected every point as an array ({of.frames}, 3) or (seeds, {of.frames}, 3), "
                f"found {name!r} of shape {points.shape}"
                + (f" and {first!r} of shape {arrays[first].shape}" if name != first else "")
            )
    if not arrays:
        raise InputError("expected points by name, found an empty dictionary")
    return np.stack(list(arrays.values()), axis=-2)


def preformatted(text: str) -> str:
    """HTML of a table of the program."""
    from html import escape

    return f"<pre>{escape(text)}</pre>"
