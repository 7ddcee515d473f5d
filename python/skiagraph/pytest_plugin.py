"""Guards a tracker's accuracy in pytest: the fixtures ``skiagraph_set`` and ``assert_no_regression``.

Loaded by pytest itself when the package is installed; it imports nothing of the package before a fixture is used.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from .comparing import AnyRun, Gate, RegressionCheck, SetMaker
    from .paths import PathName


class InconclusiveWarning(UserWarning):
    """A gate could not decide, because its intervals are too wide; the message says what would decide it."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the options."""
    group = parser.getgroup("skiagraph", "accuracy of human motion trackers")
    group.addoption(
        "--skiagraph-update-baseline",
        action="store_true",
        help="save the runs of assert_no_regression as its baselines, instead of comparing them",
    )
    group.addoption(
        "--skiagraph-inconclusive",
        choices=("warn", "fail", "pass"),
        default="warn",
        help="what an inconclusive comparison with a baseline is (default: warn)",
    )
    parser.addini("skiagraph_baselines", "folder of baselines, from the root folder", default="baselines")


@pytest.fixture(scope="session")
def skiagraph_set(pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory) -> SetMaker:
    """Makes benchmark sets: ``skiagraph_set("walk", observation__seed=2)``.

    A set is rendered once, with the public key, and kept in pytest's cache until its scenario, its settings or the
    program's version change. ``pytest --cache-clear`` removes all, which a changed recording needs.
    """
    from . import Set, program, render

    cache = getattr(pytestconfig, "cache", None)
    room = tmp_path_factory.mktemp("skiagraph") if cache is None else Path(cache.mkdir("skiagraph"))

    def made(scenario: PathName | None = None, settings: Mapping[str, Any] | None = None, **more: Any) -> Set:
        __tracebackhide__ = True
        path = Path(os.fspath(scenario)) if scenario is not None else None
        text = path.read_bytes() if path is not None and path.is_file() else b""
        stat = program().stat()
        identity = (str(scenario), text, settings, more, stat.st_size, stat.st_mtime_ns)
        digest = hashlib.sha256(repr(identity).encode()).hexdigest()[:16]
        name = f"{path.stem if path is not None else 'set'}-{digest}"
        if not (room / name).exists():
            # in one step: several processes may want the set at the same time
            own = room / f"{name}.{os.getpid()}"
            render(scenario, own, settings, **{"key": "default", **more})
            try:
                own.rename(room / name)
            except OSError:
                shutil.rmtree(own)
        return Set(room / name)

    return made


@pytest.fixture
def assert_no_regression(pytestconfig: pytest.Config) -> RegressionCheck:
    """Fails the test if a run is worse than a baseline: ``assert_no_regression(run, "walk", margin_mm=2)``.

    The baseline is ``NAME.json`` in the folder of the ini option ``skiagraph_baselines``;
    ``--skiagraph-update-baseline`` saves it. With at least five seeds, draws of the noise or clips.
    """
    from . import InputError, Verdict, gate, save_baseline

    folder = pytestconfig.rootpath / str(pytestconfig.getini("skiagraph_baselines"))

    def check(run: AnyRun | Iterable[AnyRun], name: str, margin_mm: float | None = None, **options: Any) -> Gate | None:
        __tracebackhide__ = True
        if pytestconfig.getoption("--skiagraph-update-baseline"):
            save_baseline(name, run, baselines=folder)
            return None
        if not (folder / f"{name}.json").exists():
            raise InputError(f"no baseline {folder / name}.json; save it with pytest --skiagraph-update-baseline")
        outcome = gate(run, name, margin_mm, baselines=folder, **options)
        wanted = pytestconfig.getoption("--skiagraph-inconclusive")
        if outcome.verdict is Verdict.FAIL or (outcome.verdict is Verdict.INCONCLUSIVE and wanted == "fail"):
            pytest.fail(str(outcome))
        if outcome.verdict is Verdict.INCONCLUSIVE and wanted == "warn":
            warnings.warn(InconclusiveWarning(str(outcome)), stacklevel=2)
        return outcome

    return check
