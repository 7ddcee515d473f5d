"""Comparing runs, and guarding them against regressions."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, SupportsFloat, TypeAlias

from .errors import InputError
from .executable import call, call_for_path, called_json, options
from .measuring import Result, Run, Table
from .paths import PathName, absolute, given, without_temporary

if TYPE_CHECKING:
    from .benchmark_set import Set

#: A measured or unmeasured run, the folder of one, or a folder of several.
AnyRun: TypeAlias = PathName | Run | Result


def _measured(runs: AnyRun | Iterable[AnyRun]) -> list[Path]:
    several: Iterable[Any] = [runs] if isinstance(runs, (str, PathLike)) or not isinstance(runs, Iterable) else runs
    paths = []
    for run in several:
        if not isinstance(run, (str, PathLike)):
            found = f"{type(run).__name__}; set.evaluate(...) makes a run of an array"
            raise InputError(f"expected a run, its folder or several of them, found {found}")
        path = absolute(run, "run")
        if isinstance(run, (Run, Result)) or (path / "poses.npz").exists():
            # the measures of a run that was changed are in another folder
            result = run if isinstance(run, Result) else (run if isinstance(run, Run) else Run(path)).evaluate()
            result._content("run.json")
            path = result.path
        paths.append(path)
    if not paths:
        raise InputError("expected at least one run, found none")
    # tables name runs by the paths that they are given
    here = Path.cwd()
    return [path.relative_to(here) if here in path.parents else path for path in paths]


class Comparison(Table):
    """The differences between runs, with their intervals: ``print(comparison)`` is the program's table."""


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

    Args:
        unit: of the intervals, "clips", "draws" of the noise or "seeds"; by default the first with three.
        across_sets: compare runs on different sets of the same name (other cameras or noise), without pairs.
    """
    words = ["compare", *_measured(base), "--vs", *_measured(other), *options(unit=unit, across_sets=across_sets)]
    return Comparison(called_json(words), without_temporary(call(words)[1].rstrip()))


class Verdict(enum.Enum):
    """What the gate found."""

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"


class Gate(Table):
    """The outcome of a gate: ``gate.verdict``; ``print(gate)`` is the program's table; true if it passed."""

    def __init__(self, record: dict[str, Any], text: str) -> None:
        super().__init__(record, text)
        self.verdict = Verdict(record["verdict"])

    def __bool__(self) -> bool:
        return self.verdict is Verdict.PASS


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
            `metric`; or `rules`, a file of budgets (``gate.toml``, docs/ci.md). Of `margin_mm` and `margin` give one.
        unit: of the intervals, "seeds", "draws" of the noise or "clips"; by default the first with five.
        other_seeds: allow seeds that are not the baseline's; they are then not paired.
    """
    if margin_mm is not None and margin is not None:
        raise InputError(f"expected one margin, found margin_mm={margin_mm!r} and margin={margin!r}")
    if isinstance(margin_mm, (bool, str)) or not isinstance(margin_mm, SupportsFloat | None):
        raise InputError(f"margin_mm: expected a number of millimetres, found {margin_mm!r}; margin takes text, '2mm'")
    if margin is not None and not isinstance(margin, str):
        raise InputError(f"margin: expected text with a unit, as in '2mm', found {margin!r}; millimetres are margin_mm")
    if isinstance(baseline, PathLike) and not Path(baseline).exists():
        raise InputError(f"{fspath(baseline)}: no baseline is here; save_baseline(name, runs) makes one")
    margin = margin if margin_mm is None else f"{float(margin_mm)!r}mm"
    words = ["gate", *_measured(run), *options(baseline=given(baseline, "baseline"), margin=margin, metric=metric)]
    words += options(rules=rules, baselines=baselines, unit=unit, other_seeds=other_seeds)
    return Gate(called_json(words, may=(1, 3)), without_temporary(call(words, may=(1, 3))[1].rstrip()))


def save_baseline(
    name: str, run: AnyRun | Iterable[AnyRun], *, baselines: PathName | None = None, force: bool = False
) -> Path:
    """Saves measured runs as a baseline for :func:`gate`; returns its file, which is to be committed.

    A baseline of this name is always replaced, also by a worse one: keep it in version control. `force` is for a file
    of its name that skiagraph did not write, which becomes NAME.json~.
    """
    words = options(baselines=baselines, force=force)
    if not isinstance(name, str) or name.startswith("-"):
        raise InputError(f"expected the name of a baseline as text, found {type(name).__name__} {name!r:.80}")
    return call_for_path(["baseline", "save", name, *_measured(run), *words])[1]


class SetMaker(Protocol):
    """What the fixture ``skiagraph_set`` is."""

    def __call__(self, scenario: PathName | None = None, settings: Mapping[str, Any] | None = None, **more: Any) -> Set:
        """The set of a scenario; the arguments are those of :func:`skiagraph.render`."""
        ...


class RegressionCheck(Protocol):
    """What the fixture ``assert_no_regression`` is."""

    def __call__(
        self, run: AnyRun | Iterable[AnyRun], name: str, margin_mm: float | None = None, **options: Any
    ) -> Gate | None:
        """Fails unless the gate passes; the arguments are those of :func:`skiagraph.gate`."""
