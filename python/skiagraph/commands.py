"""Rendering sets, tracking them, and sweeps of settings."""

from __future__ import annotations

import json
import os
import re
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from os import fspath
from pathlib import Path
from typing import Any

from .arrays import Named
from .benchmark_set import Set
from .errors import InputError, reading
from .executable import call, check, dotted, in_python, option, options, overrides, start, stop, toml
from .measuring import Folder, Metrics, Run
from .paths import PathName, given, place
from .tracking import AnyTracker, Frame, converse, name_of

#: Scenes that need no file, as changes of the scenario that is built into the program.
_SCENES: dict[str, dict[str, Any]] = {
    "walk": {},
    "run": {"name": "run", "motion.clip": "embedded:run"},
    "jump": {"name": "jump", "motion.clip": "embedded:jump"},
    "segmented": {"name": "walk-segmented", "observation.silhouette": "segmented"},
}


def render(
    scenario: PathName | None,
    out: PathName | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    key: str | None = None,
    truth: PathName | None = None,
    mocap_dir: PathName | None = None,
    force: bool = False,
    progress: bool = False,
    **more: Any,
) -> Set:
    """Makes a benchmark set, as ``skiagraph render`` does; an interrupted one is resumed.

    Args:
        scenario: a scenario file (not a sweep), or the name of a scene that needs none: "walk" (also None), "run",
            "jump" and "segmented", the walk with silhouettes from images.
        out: folder of the set; by default a temporary one, which lives as long as the returned set.
        settings: keys of the scenario to change: ``{"rig.ring.count": 2}``. As keyword arguments two
            underscores stand for a dot (``rig__ring__count=2``); a key's last part is enough where it is unambiguous
            (``count=2``).
        key: key of the random numbers; "default" gives everybody the same bytes.
        truth: folder for the complete set; `out` is then the set without its truth.
        mocap_dir: folder that is searched, also below it, for the recordings of the scenario ($SKIAGRAPH_MOCAP).
        force: replace an existing set.
    """
    if isinstance(out, Mapping):
        raise InputError("out: expected a path, found a dictionary; changes of the scenario are settings={...}")
    if _is_sweep(scenario):
        raise InputError(f"{scenario}: this is a sweep file; skiagraph.sweep({str(scenario)!r}) runs it")
    out, keep = place(out, "set", force=True)
    words = options(out=out, key=key, truth=truth, mocap_dir=mocap_dir, force=force, json=True)
    call(["render", *_scenario(scenario, settings, more), *words], progress=progress)
    return Set(out, truth_at=truth, keep=keep)


def _is_sweep(scenario: PathName | None) -> bool:
    path = Path("" if scenario is None else given(scenario, "scenario"))
    return path.is_file() and bool(re.search(r'(?m)^schema *= *"skiagraph\.sweep/', path.read_text("utf-8", "replace")))


def _scenario(
    scenario: PathName | None, settings: Mapping[str, Any] | None, more: Mapping[str, Any] | None = None, axes: Any = ()
) -> list[str]:
    """A scenario file, or the changes of a named scene that no given key or axis replaces, and the changes of keys."""
    changed = overrides(settings, more)
    name = "walk" if scenario is None else given(scenario, "scenario")
    if name in _SCENES and not Path(name).is_file():
        keys = tuple(f".{key}" for key in [*(change.partition("=")[0] for change in changed), *axes])
        scene = {key: value for key, value in _SCENES[name].items() if not f".{key}".endswith(keys)}
        return overrides(scene) + changed
    if not Path(name).exists() and Path(name).name == name and not Path(name).suffix:
        raise InputError(f"scenario: there is no file {name!r}, and no scene: those are {', '.join(_SCENES)}")
    return [name, *changed]


@dataclass(frozen=True)
class Program:
    """A tracker that is a program of its own, in any language (docs/protocol.md): ``Program("python3 my_tracker.py")``.

    ``{KEY}`` in the command stands for its setting KEY. With ``sandbox`` it sees neither the truth nor the network, and
    only what ``readable`` grants (Linux, bubblewrap).
    """

    command: str
    inline: bool = False
    sandbox: bool = False
    readable: Sequence[PathName] = ()

    def _options(self) -> list[str]:
        if not isinstance(self.command, str):
            raise InputError(f"expected the command of a program as text, found {self.command!r:.80}")
        readable = [word for path in self.readable for word in option("readable", given(path, "readable"))]
        return options(exec=self.command, inline=self.inline, sandbox=self.sandbox) + readable


def track(
    of: Set | PathName,
    tracker: AnyTracker | Program | str,
    *,
    out: PathName | None = None,
    seeds: int | None = None,
    seed: int | None = None,
    settings: Mapping[str, Any] | None = None,
    frame_limit: float | None = None,
    start_limit: float | None = None,
    restarts: int | None = None,
    name: str | None = None,
    force: bool = False,
    progress: bool = False,
) -> Run:
    """Runs a tracker on a set, as ``skiagraph track`` does, frame by frame and without the truth.

    Args:
        tracker: a function of a :class:`Frame`, or an object or class with ``start(info)`` and ``track(frame)``,
            called in this process; a :class:`Program` or the name of one of skiagraph's trackers, with its `settings`.
        out: folder of the run; by default a temporary one, which lives as long as the returned run. After an
            interruption a tracker in this process starts anew; the others keep finished seeds.
        seeds, seed: how often the tracker is run (once), and the first seed, ``info.seed`` (0). A tracker without
            random numbers gives the same answers every time.
        frame_limit, start_limit: seconds for a frame (30) and until the tracker is ready (60). A later answer is lost.
            A program is then ended and started again. A tracker in this process is not interrupted: it finishes the
            frame and goes on with the next one, with its state and a warning.
        restarts: how often that may happen to a seed, or a program crash (3); one more loses all further frames.
        name: of a tracker in this process, in tables; by default that of its function or class.
        force: replace results in `out`; output of another command is moved aside, to OUT~.
        progress: show a line of progress on standard error.

    Raises:
        TrackerError: the tracker, in this process, raised an exception or answered something that is no estimate.
        InputError: no frame was answered, an argument is wrong, or `out` has results.
    """
    of = of if isinstance(of, Set) else Set(of)
    if settings and not isinstance(tracker, (str, Program)):
        raise InputError("settings are those of programs and skiagraph's own trackers; give yours to its constructor")
    if not isinstance(named := name or (tracker if isinstance(tracker, str) else name_of(tracker)), str):
        raise InputError(f"name: expected text, found {type(name).__name__} {name!r:.80}")
    out, keep = place(out, named, force=force)
    limits = options(frame_limit=frame_limit, start_limit=start_limit, restarts=restarts)
    words = ["track", fspath(of), *options(out=out, seeds=seeds, seed=seed, force=force), *limits]
    if isinstance(tracker, str):
        call([*words, f"--tracker={tracker}", *overrides(settings)], progress=progress)
    elif isinstance(tracker, Program):
        words += [*tracker._options(), *overrides(settings)]
        code, text = call(words, progress=progress, may=(1,))
        if code == 1:
            raise InputError(in_python(text.strip()), code)
    else:
        # a tracker in this process is not resumed: its code and state may have changed
        if _track_here([*words, "--anew"], tracker, named, progress) == 1:
            raise InputError(f"{named}: no frame was answered with a pose, so there is nothing to measure", 1)
    run = Run(out, of, keep)
    answers = run.program["answers"] if run.program else {}
    # a failed frame is an incident, unless the tracker was not asked any more
    if (unasked := answers.get("failed", 0) - len(run.incidents)) > 0:
        warnings.warn(f"{unasked} frames are lost after too many failures; restarts=... allows more", RuntimeWarning, 2)
    return run


def _track_here(words: list[str], tracker: AnyTracker, name: str, progress: bool) -> int:
    """Runs the program with a bridge as its tracker, and answers what comes over the bridge."""
    import socket
    import subprocess

    from . import bridge

    kept: dict[int, Any] = {}
    password, file = os.urandom(16).hex(), str(Path(bridge.__file__).absolute())
    command = f'"${bridge.PYTHON}" -IS "${bridge.FILE}" {{tracker}}'
    if sys.platform == "win32":
        command = subprocess.list2cmdline([sys.executable, "-IS", file]) + " {tracker}"
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.02)
        variables = {bridge.PYTHON: sys.executable, bridge.FILE: file}
        variables[bridge.VARIABLE] = f"{server.getsockname()[1]}:{password}"
        child = start([*words, f"--exec={command}", f"settings.tracker={toml(name)}"], environment=variables)
        try:
            while True:
                has_ended = child.poll() is not None
                try:
                    peer, _ = server.accept()
                except TimeoutError:
                    if has_ended:
                        break
                    continue
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                # skiagraph ends the conversation when a time limit has passed, and records that
                with (
                    suppress(ConnectionError),
                    peer,
                    peer.makefile("r", encoding="utf-8") as requests,
                    peer.makefile("w", encoding="utf-8") as answers,
                ):
                    if requests.read(len(password)) == password:
                        converse(tracker, requests, answers, name, _show_progress if progress else None, kept)
                        # processes that were forked meanwhile have the socket too, so that closing it is not enough
                        with suppress(OSError):
                            peer.shutdown(socket.SHUT_RDWR)
            out, said = child.communicate()
        except BaseException as error:
            stop(child, error)
            raise
    try:
        return check(child.returncode, out, said, may=(1,))
    except InputError as error:
        if error.fields.get("kind") != "program":
            raise
        # it is this tracker, not the program that stands for it
        text = f"the tracker {name}: it {error.fields['detail']}"
        last = " / ".join(error.fields["stderr"])
        raise InputError(text + (f"; its last lines: {last}" if last else ""), error.exit_code, error.fields) from None


def _show_progress(frame: Frame) -> None:
    done, frames = frame.index + 1, frame.info.frames
    if done % max(1, frames // 100) == 0 or done == frames:
        end = "\n" if done == frames else ""
        print(f"\rseed {frame.info.seed}: {100 * done // frames} %", end=end, file=sys.stderr, flush=True)


class Axes(Named[Any]):
    """Values by the key of a scenario, in which two underscores may stand for a dot: ``axes["rig__ring__count"]``."""

    def __missing__(self, key: str) -> Any:
        return super().__missing__(key) if (other := dotted(key)) == key else self[other]


@dataclass(frozen=True)
class Cell:
    """One setting of a sweep with one seed.

    ``axes`` are the values of the axes by key, also of those with one value. ``status`` is ``ok``, ``diverged`` (lost
    the body) or ``failed``. ``metrics`` are the means of all metrics that could be computed: of a failed cell none, of
    a diverged one perhaps not all. ``record`` is everything, as in ``runs.jsonl``.
    """

    axes: Axes
    seed: int
    status: str
    metrics: Metrics
    record: dict[str, Any]


class Sweep(Folder):
    """A finished sweep: its cells one after another; ``print(sweep)`` is the program's table."""

    def __init__(
        self, path: PathName, text: str, keep: object = None, axes: Mapping[str, Sequence[Any]] | None = None
    ) -> None:
        super().__init__(path, keep)
        self._text = text
        # the program records an axis with one value as a setting
        self._fixed = {key: values[0] for key, values in (axes or {}).items() if len(values) == 1}

    def __iter__(self) -> Iterator[Cell]:
        return iter(self._cells)

    def __len__(self) -> int:
        return len(self._cells)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"Sweep({str(self.path)!r}: {len(self)} cells)"

    @cached_property
    def _cells(self) -> list[Cell]:
        with reading(path := self.path / "runs.jsonl", "the cells of a sweep", "make it again"):
            return [self._cell(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]

    def _cell(self, found: dict[str, Any]) -> Cell:
        axes = Axes({**self._fixed, **found["axes"]}, "axis")
        return Cell(axes, found["seed"], found["status"], Metrics(found["metrics"], "metric"), found)


def sweep(
    scenario: PathName | None,
    axes: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    tracker: Program | str | None = None,
    out: PathName | None = None,
    seeds: int | None = None,
    draws: bool = False,
    pair: bool = False,
    jobs: int | None = None,
    mocap_dir: PathName | None = None,
    progress: bool = False,
) -> Sweep:
    """Runs trackers with every combination of settings, as ``skiagraph sweep`` does; cells with results in `out` are
    not run again.

    Args:
        scenario: as of :func:`render`; or a sweep file, which has axes of its own.
        axes: the values of every axis by key: ``{"particles": [50, 100], "rig.ring.count": [2, 4]}``. A number or text
            is an axis with one value.
        settings: keys that all cells share.
        tracker: a program, whose settings can be axes too, or the name of one of skiagraph's trackers; by default
            those of the scenario.
        seeds: how often every combination is run; by default as often as the scenario says.
        draws: draw new noise for every seed.
        pair: pair the values of the axes one to one instead; every axis needs as many.
        jobs: how many cells run at a time; by default one for every core.
    """
    axes = {} if axes is None else axes
    if not isinstance(axes, Mapping):
        raise InputError(f'expected axes as a dictionary, {{"particles": [50, 100]}}, found {type(axes).__name__}')
    listed = {dotted(key): _values(key, values) for key, values in axes.items()}
    if not listed and not _is_sweep(scenario):
        raise InputError('expected at least one axis, {"particles": [50, 100]}, found none')
    if pair and len({len(values) for values in listed.values()}) > 1:
        counts = ", ".join(f"{key} {len(values)}" for key, values in listed.items())
        raise InputError(f"expected as many values on every axis to pair them, found {counts}")
    out, keep = place(out, "sweep", force=True)
    if tracker is not None and not isinstance(tracker, (Program, str)):
        raise InputError("a sweep starts programs: end a file with skiagraph.serve(tracker) and give Program(command)")
    chosen = tracker._options() if isinstance(tracker, Program) else option("tracker", tracker)
    varied = [f"{key}={','.join(toml(value, key) for value in values)}" for key, values in listed.items()]
    words = options(out=out, seeds=seeds, draws=draws, zip=pair, jobs=jobs, mocap_dir=mocap_dir)
    words = ["sweep", *_scenario(scenario, settings, axes=listed), *varied, *chosen, *words]
    _, text = call(words, progress=progress, may=(1, 3))
    return Sweep(out, text.rstrip(), keep, listed)


def _values(key: str, values: Any) -> list[Any]:
    """The values of an axis; text, a number or a table is one."""
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, (str, Mapping)) or not isinstance(values, Iterable):
        return [values]
    if listed := list(values):
        return listed
    raise InputError(f"axis {key}: expected at least one value, found none")
