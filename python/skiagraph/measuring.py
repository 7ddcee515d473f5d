"""Runs and their measures: evaluating estimates, comparing runs, guarding against regressions."""

from __future__ import annotations

import csv
import enum
import json
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import described, unmasked
from .benchmark_set import Arrays, PathName, Set
from .errors import InputError, ProgramError
from .executable import call, options, toml
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
        self.path = Path(fspath(path))
        self._keep = keep

    def __fspath__(self) -> str:
        return str(self.path)

    def _json(self, name: str) -> dict[str, Any]:
        try:
            found: dict[str, Any] = json.loads((self.path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.path / name}: expected a file that skiagraph wrote: {error}") from None
        return found


class Run(Folder):
    """The estimates of one tracker on one set. ``run.measure()`` compares them with the truth.

    Give ``of``, the set, to a run that is read again from its folder.
    """

    def __init__(self, path: PathName, of: Set | None = None, keep: object = None) -> None:
        super().__init__(path, keep)
        self.set = of

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

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
        import pandas

        table: pandas.DataFrame = pandas.DataFrame.from_dict(self.record["metrics"], orient="index")
        return table

    def plot(self, metric: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draws a metric by time, one line for every seed; by default the main error. Needs matplotlib.

        Raises:
            InputError: the metric has no values by frame.
        """
        from matplotlib import pyplot

        metric = next(name for name in self.per_frame if name != "time_s") if metric is None else metric
        if metric not in self.per_frame:
            raise InputError(f"{metric!r} has no values by frame; those that have are {', '.join(self.per_frame)}")
        axes = pyplot.subplots()[1] if ax is None else ax
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
        return _preformatted(str(self)) + (image if picture else "")


def evaluate(
    of: Set,
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
    out: PathName | None = None,
    force: bool = False,
    progress: bool = False,
) -> Result:
    """Measures an estimate against the truth of a set, as ``skiagraph evaluate`` does.

    Args:
        estimate: a run; a file (``.npz``, ``.csv``, ``.trc``, ``.c3d``, ``.bvh``); an array (frames, points, 3) or
            (seeds, frames, points, 3), metres, NaN or masked where there is no estimate; a dictionary of such points
            by name, each (frames, 3); or a dictionary of the arrays of an ``.npz`` (docs/estimates.md).
        names: the points of an array, and of nothing else; by default the set's markers, in the order of
            ``truth.marker_names``.
        pipeline: the program that wrote the file, ``"pose2sim"`` for example, whose axes and names are then known.
        units, up, axes, angles, swap_sides, shift, offset, joint_map: how the estimate is read (docs/estimates.md).
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
    if isinstance(names, str):
        raise InputError(f"expected names=[...], one for every point, found the text {names!r}")
    if names is not None and isinstance(estimate, (str, PathLike, Mapping)):
        raise InputError(
            "names are those of an array's points; a run, a file or a dictionary has its own (joint_map renames them)"
        )
    with tempfile.TemporaryDirectory(prefix="skiagraph-") as room:
        keep: object = None
        if isinstance(estimate, (str, PathLike)):
            file = Path(fspath(estimate)).absolute()
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
            truth=of._truth_at and of._truth_at.absolute(),
            units=units,
            up=up,
            axes=axes,
            angles=angles,
            swap_sides=swap_sides,
            shift=shift,
            offset=None if offset is None else _metres(offset),
            joint_map=None if joint_map is None else Path(fspath(joint_map)).absolute(),
            out=None if out is None else Path(fspath(out)).absolute(),
            force=force,
            **{"from": pipeline},
        )
        # a file of ours is named without its temporary folder, so that the same call replaces its own results
        named = file.name if file.parent == Path(room) else file
        try:
            _, text = call(["evaluate", of.path.absolute(), named, *words], progress=progress, cwd=room)
        except InputError as error:
            raise InputError(str(error).replace(_ARRAY, "the array"), error.exit_code) from None
    table, said, report = text.rstrip().rpartition("\n\n  report: ")
    if not said:
        raise ProgramError(f"skiagraph evaluate did not say where its report is: {text}")
    return Result(Path(report).parent, table.replace(_ARRAY, "the array"), keep)


def _metres(offset: Sequence[float]) -> str:
    try:
        return ",".join(f"{float(part)!r}" for part in offset)
    except (TypeError, ValueError):
        raise InputError(f"offset: expected three numbers in metres, found {offset!r}") from None


def _written(of: Set, estimate: Any, names: Sequence[str] | None, to: Path) -> Path:
    if isinstance(estimate, Mapping):
        if any(str(name).startswith("estimate_") for name in estimate):
            arrays = {str(name): unmasked(values) for name, values in estimate.items()}
            return _saved(to, {"fps": np.float64(of.fps), **arrays})
        names = [str(name) for name in estimate]
        estimate = _stacked(of, estimate)
    points = unmasked(estimate)
    markers: list[str] = of.truth.marker_names.tolist()
    names = markers if names is None else list(names)
    expected = f"({of.frames}, {len(names)}, 3) or (seeds, {of.frames}, {len(names)}, 3)"
    if points.dtype.kind not in "fiu" or points.dtype == np.float16:
        raise InputError(f"expected numbers of 32 or 64 bits, shape {expected}, found {described(estimate, points)}")
    if points.ndim not in (3, 4) or points.shape[-2:] != (len(names), 3):
        raise InputError(
            f"expected an array (frames, points, 3) or (seeds, frames, points, 3) with {len(names)} points "
            f"({', '.join(names)}), here {expected}, found shape {points.shape}; other points need names=[...]"
        )
    is_joints = set(names) <= set(of.joint_names) - set(markers)
    key, key_names = ("estimate_joints", "estimate_joint_names") if is_joints else ("estimate_markers", "marker_names")
    points = points if points.ndim == 4 else points[None]
    seeds = np.arange(len(points))
    return _saved(to, {"fps": of.fps, "seeds": seeds, key: points, key_names: np.array(names)})


def _saved(to: Path, arrays: dict[str, Any]) -> Path:
    np.savez(to, **arrays)
    return to


def _stacked(of: Set, named: Mapping[Any, ArrayLike]) -> NDArray[Any]:
    arrays = {name: unmasked(points) for name, points in named.items()}
    for name, points in arrays.items():
        if points.ndim < 2 or points.shape[-1] != 3 or points.shape != next(iter(arrays.values())).shape:
            first = next(iter(arrays))
            raise InputError(
                f"expected every point as an array ({of.frames}, 3) or (seeds, {of.frames}, 3), "
                f"found {name!r} of shape {points.shape} and {first!r} of shape {arrays[first].shape}"
            )
    if not arrays:
        raise InputError("expected points by name, found an empty dictionary")
    return np.stack(list(arrays.values()), axis=-2)


#: A measured or unmeasured run, the folder of one, or a folder of several.
AnyRun: TypeAlias = PathName | Run | Result


def _measured(runs: AnyRun | Iterable[AnyRun]) -> list[Path]:
    several: Iterable[Any] = [runs] if isinstance(runs, (str, PathLike)) or not isinstance(runs, Iterable) else runs
    listed: list[AnyRun] = list(several)
    for run in listed:
        if not isinstance(run, (str, PathLike)):
            raise InputError(
                f"expected a run, its folder or several of them, found {type(run).__name__}; "
                "set.evaluate(...) makes a run of an array"
            )
    if not listed:
        raise InputError("expected at least one run, found none")
    return [run.measure().path if isinstance(run, Run) else Path(fspath(run)) for run in listed]


def _preformatted(text: str) -> str:
    from html import escape

    return f"<pre>{escape(text)}</pre>"


class Comparison:
    """The differences between runs, with their intervals: ``print(comparison)`` is the program's table."""

    def __init__(self, record: dict[str, Any], text: str) -> None:
        #: Everything, as ``skiagraph compare --json`` prints it.
        self.record = record
        self._text = in_python(text)

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return _preformatted(self._text)


def compare(
    base: AnyRun | Iterable[AnyRun],
    other: AnyRun | Iterable[AnyRun],
    *,
    unit: str | None = None,
    across_sets: bool = False,
) -> Comparison:
    """Every metric of `other` minus that of `base`, with its 95 % interval, as ``skiagraph compare`` does.

    Each side is a run, a folder of runs, or several of them (draws of the noise, clips). Runs that are not measured are
    measured first. Intervals need three seeds, draws or clips.

    >>> walk = Set("sets/walk")
    >>> found = compare(track(walk, "frozen", seeds=3), walk.evaluate(walk.truth.markers))
    >>> "HumanEva 3-D error, mm" in str(found)
    True
    """
    words = ["compare", *_measured(base), "--vs", *_measured(other), *options(unit=unit, across_sets=across_sets)]
    return Comparison(json.loads(call([*words, "--json"])[1]), call(words)[1].rstrip())


class Verdict(enum.Enum):
    """What the gate found."""

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"


class Gate:
    """The outcome of a gate: ``gate.verdict``; ``print(gate)`` is the program's table; true if it passed."""

    def __init__(self, record: dict[str, Any], text: str) -> None:
        #: Everything, as ``skiagraph gate --json`` prints it.
        self.record = record
        self.verdict = Verdict(record["verdict"])
        self._text = in_python(text)

    def __bool__(self) -> bool:
        return self.verdict is Verdict.PASS

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return _preformatted(self._text)


def gate(
    run: AnyRun | Iterable[AnyRun],
    baseline: str | PathName,
    margin_mm: float | None = None,
    *,
    margin: str | None = None,
    metric: str | None = None,
    rules: PathName | None = None,
    baselines: PathName | None = None,
    unit: str | None = None,
    other_seeds: bool = False,
) -> Gate:
    """Whether runs are worse than a baseline by more than a margin, as ``skiagraph gate`` finds.

    Args:
        run: a run, a folder of runs or several of them. Runs that are not measured are measured first.
        baseline: name of a baseline in the folder `baselines`, or its ``.json`` file (:func:`save_baseline`).
        margin_mm: the largest allowed worsening of the error, millimetres; or `margin` with a unit ("1.5deg", "5%") of
            `metric`; or `rules`, a file of budgets. Of `margin_mm` and `margin` give one.

    Raises:
        InputError: there is no such baseline, or run and baseline cannot be compared; the message says why.

    >>> few = {"particles": 5, "layers": 1}
    >>> run = track(Set("sets/walk"), "annealed_particle_filter", seeds=5, settings=few)
    >>> save_baseline("walk", run, baselines="baselines").name
    'walk.json'
    >>> gate(run, "walk", margin_mm=2, baselines="baselines").verdict
    <Verdict.PASS: 'pass'>
    """
    if margin_mm is not None and margin is not None:
        raise InputError(f"expected one margin, found margin_mm={margin_mm!r} and margin={margin!r}")
    if isinstance(baseline, PathLike) and not Path(baseline).exists():
        raise InputError(f"{fspath(baseline)}: no baseline is here; save_baseline(name, runs) makes one")
    words = options(
        baseline=fspath(baseline),
        margin=f"{float(margin_mm)!r}mm" if margin_mm is not None else margin,
        metric=metric,
        rules=None if rules is None else fspath(rules),
        baselines=None if baselines is None else fspath(baselines),
        unit=unit,
        other_seeds=other_seeds,
    )
    words = ["gate", *map(str, _measured(run)), *words]
    outcome = json.loads(call([*words, "--json"], may=(1, 3))[1])
    return Gate(outcome, call(words, may=(1, 3))[1].rstrip())


def save_baseline(
    name: str, run: AnyRun | Iterable[AnyRun], *, baselines: PathName | None = None, force: bool = False
) -> Path:
    """Saves measured runs as a baseline for :func:`gate`; returns its file, which is to be committed.

    Raises:
        InputError: there are too few seeds, draws or clips; the message says how many are needed.
    """
    words = options(baselines=None if baselines is None else fspath(baselines), force=force)
    text = call(["baseline", "save", name, *_measured(run), *words])[1]
    path = next((line.partition(".json: ")[0] for line in text.splitlines() if ".json: " in line), None)
    if path is None:
        raise ProgramError(f"skiagraph baseline save did not say where it saved {name}: {text}")
    return Path(path + ".json")
