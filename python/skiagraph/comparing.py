"""Comparing runs, and guarding them against regressions."""

from __future__ import annotations

import enum
import json
import re
from collections.abc import Iterable
from os import PathLike, fspath
from pathlib import Path
from typing import Any, SupportsFloat, TypeAlias

from .bridge import is_bridge
from .errors import InputError, ProgramError
from .executable import call, options
from .measuring import Result, Run, preformatted
from .paths import PathName, absolute, given, shown
from .wording import in_python, is_temporary

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
    paths = [run.measure().path if isinstance(run, Run) else absolute(run, "run") for run in listed]
    return [shown(path) for path in paths]


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
        return preformatted(self._text)


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

    Raises:
        InputError: the runs cannot be compared; the message says why.

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
        self._text = in_python(_with_advice(record, text))

    def __bool__(self) -> bool:
        return self.verdict is Verdict.PASS

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return preformatted(self._text)


#: Two commands that differ by the tracker's name, in a list of differences that has the names too.
_COMMANDS = re.compile(r'command "(?:\\.|[^"\\…])*["…] → "(?:\\.|[^"\\…])*["…], (?=name )')


def _with_advice(record: dict[str, Any], text: str) -> str:
    """The table with advice that can be followed here, where the program's has commands of trackers in this process."""
    for note in record["notes"]:
        # a temporary run vanishes before a command could read it
        mended, _, command = note.partition("; for a table with times: ")
        if is_bridge(note):
            mended = _advice(record) if "skiagraph track " in note else _COMMANDS.sub("", note)
        elif not is_temporary(command):
            continue
        text = text.replace(note, mended)
    return text


def _advice(record: dict[str, Any]) -> str:
    """How to run the further seeds, draws or clips that would decide a gate."""
    counts: dict[str, int] = {}
    for check in record["checks"]:
        if isinstance(more := check["more_seeds"], dict):
            counts.update({side: max(count, counts.get(side, 0)) for side, count in more.items()})
    more, unit = max(counts.values()), record["unit"]
    if unit != "seeds":
        return (
            f"it needs {more} more {unit}: render sets with another observation__seed or motion, track the run and the "
            "baseline on all of them, and save the baseline again with save_baseline(name, runs)"
        )
    both = "the run and the baseline" if "of_both" in counts else "the run"
    again = "; save the baseline again with save_baseline(name, run)" if "of_both" in counts else ""
    return f"track {both} with {more} more seeds, by a larger number in track(set, tracker, seeds=...){again}"


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
    if margin is not None and not isinstance(margin, str):
        raise InputError(f"margin: expected text with a unit, as in '2mm', found {margin!r}; millimetres are margin_mm")
    if isinstance(baseline, PathLike) and not Path(baseline).exists():
        raise InputError(f"{fspath(baseline)}: no baseline is here; save_baseline(name, runs) makes one")
    words = options(
        baseline=given(baseline, "baseline"),
        margin=margin if margin_mm is None else _millimetres(margin_mm),
        metric=metric,
        rules=None if rules is None else given(rules, "rules"),
        baselines=None if baselines is None else given(baselines, "baselines"),
        unit=unit,
        other_seeds=other_seeds,
    )
    words = ["gate", *map(str, _measured(run)), *words]
    outcome = json.loads(call([*words, "--json"], may=(1, 3))[1])
    return Gate(outcome, call(words, may=(1, 3))[1].rstrip())


def _millimetres(margin: Any) -> str:
    if isinstance(margin, (bool, str)) or not isinstance(margin, SupportsFloat):
        raise InputError(
            f"margin_mm: expected a number of millimetres, found {margin!r}; margin takes text, as in '2mm'"
        )
    return f"{float(margin)!r}mm"


def save_baseline(
    name: str, run: AnyRun | Iterable[AnyRun], *, baselines: PathName | None = None, force: bool = False
) -> Path:
    """Saves measured runs as a baseline for :func:`gate`; returns its file, which is to be committed.

    Raises:
        InputError: there are too few seeds, draws or clips; the message says how many are needed.
    """
    words = options(baselines=None if baselines is None else given(baselines, "baselines"), force=force)
    if not isinstance(name, str):
        raise InputError(f"expected the name of a baseline as text, found {type(name).__name__} {name!r:.80}")
    text = call(["baseline", "save", name, *_measured(run), *words])[1]
    path = next((line.partition(".json: ")[0] for line in text.splitlines() if ".json: " in line), None)
    if path is None:
        raise ProgramError(f"skiagraph baseline save did not say where it saved {name}: {text}")
    return absolute(path + ".json", "baseline")
