"""The plugin in the pytest runs of a user."""

import importlib.metadata
import re
from pathlib import Path

import pytest

TRACKER = """
    import pytest
    SMALL = {"loop_to_s": 0.2, "rig.ring.count": 2, "size_px": [96, 72], "start_mm": 5.0}

    @pytest.fixture(scope="session")
    def runs(skiagraph_set):
        import skiagraph
        shift = %s
        def tracker(frame):
            return {name: place + [0, shift, 0] for name, place in frame.info.start.markers.items()}
        sets = [skiagraph_set("walk", SMALL, observation__seed=n) for n in range(5)]
        return [skiagraph.track(each, tracker) for each in sets]

    def test_accuracy(runs, assert_no_regression):
        assert_no_regression(runs, "walk", margin_mm=2)
"""


@pytest.fixture
def user(pytester):
    """Runs pytest as a user with the package installed; a checkout's plugin is not found by itself."""
    installed = any(entry.name == "skiagraph" for entry in importlib.metadata.entry_points(group="pytest11"))

    def run(shift, *options):
        pytester.makepyfile(TRACKER % shift)
        plugin = [] if installed else ["-p", "skiagraph.pytest_plugin"]
        return pytester.runpytest_subprocess(*plugin, *options)

    return run


def test_a_baseline_is_saved_kept_and_defended(user, pytester):
    without = user(0.0)
    without.assert_outcomes(failed=1)
    without.stdout.fnmatch_lines(["*no baseline *walk.json; save it with pytest --skiagraph-update-baseline"])
    sets = sorted((pytester.path / ".pytest_cache/d/skiagraph").iterdir())
    assert len(sets) == 5

    user(0.0, "--skiagraph-update-baseline").assert_outcomes(passed=1)
    assert (pytester.path / "baselines/walk.json").exists()
    user(0.0).assert_outcomes(passed=1)
    worse = user(0.3)
    worse.assert_outcomes(failed=1)
    worse.stdout.fnmatch_lines(["*FAIL*humaneva_mm*worse*margin 2.0 mm*"])
    # sets are rendered once
    assert sorted((pytester.path / ".pytest_cache/d/skiagraph").iterdir()) == sets


def test_the_example_of_the_documentation_renders_once_and_then_compares(pytester):
    page = (Path(__file__).parents[2] / "docs/python.md").read_text(encoding="utf-8")
    pytester.makepyfile(re.search(r"```python\n([^`]*skiagraph_set[^`]*)```", page)[1])
    installed = any(entry.name == "skiagraph" for entry in importlib.metadata.entry_points(group="pytest11"))
    plugin = [] if installed else ["-p", "skiagraph.pytest_plugin"]
    pytester.runpytest_subprocess(*plugin, "--skiagraph-update-baseline").assert_outcomes(passed=1)
    sets = sorted((pytester.path / ".pytest_cache/d/skiagraph").iterdir())
    assert len(sets) == 5
    pytester.runpytest_subprocess(*plugin).assert_outcomes(passed=1)
    assert sorted((pytester.path / ".pytest_cache/d/skiagraph").iterdir()) == sets


NOISY = """
    import numpy, pytest, skiagraph

    class Noisy:
        def start(self, info):
            self.shift = numpy.random.default_rng(info.seed + %s).normal(0, 0.1)
        def track(self, frame):
            return {name: place + self.shift for name, place in frame.info.start.markers.items()}

    def test_accuracy(skiagraph_set, assert_no_regression):
        small = skiagraph_set("walk", loop_to_s=0.2, rig__ring__count=2, size_px=[96, 72])
        assert_no_regression(skiagraph.track(small, Noisy, seeds=5), "noisy", margin_mm=2)
"""


def test_an_inconclusive_comparison_warns_fails_or_passes(user, pytester):
    def run(first, *options):
        pytester.makepyfile(NOISY % first)
        installed = any(entry.name == "skiagraph" for entry in importlib.metadata.entry_points(group="pytest11"))
        return pytester.runpytest_subprocess(*([] if installed else ["-p", "skiagraph.pytest_plugin"]), *options)

    run(0, "--skiagraph-update-baseline").assert_outcomes(passed=1)
    warned = run(100)
    warned.assert_outcomes(passed=1, warnings=1)
    warned.stdout.fnmatch_lines(["*InconclusiveWarning: INCONCLUSIVE*"])
    run(100, "--skiagraph-inconclusive=fail").assert_outcomes(failed=1)
    run(100, "--skiagraph-inconclusive=pass").assert_outcomes(passed=1)


def test_the_options_are_in_the_help(pytester):
    installed = any(entry.name == "skiagraph" for entry in importlib.metadata.entry_points(group="pytest11"))
    told = pytester.runpytest_subprocess(*([] if installed else ["-p", "skiagraph.pytest_plugin"]), "--help")
    told.stdout.fnmatch_lines(["*--skiagraph-update-baseline*", "*--skiagraph-inconclusive*", "*skiagraph_baselines*"])


SHARED = """
    import pytest, skiagraph

    @pytest.mark.parametrize("number", range(4))
    def test_a_set_is_shared(skiagraph_set, number):
        small = skiagraph_set("walk", loop_to_s=0.2, rig__ring__count=2, size_px=[96, 72])
        assert small.masks(number % 2)[0].any()
        assert skiagraph.track(small, "frozen").estimate
"""


def test_processes_of_xdist_share_a_set(pytester):
    pytest.importorskip("xdist")
    pytester.makepyfile(SHARED)
    installed = any(entry.name == "skiagraph" for entry in importlib.metadata.entry_points(group="pytest11"))
    plugin = [] if installed else ["-p", "skiagraph.pytest_plugin"]
    pytester.runpytest_subprocess(*plugin, "-n", "2").assert_outcomes(passed=4)
    assert len(list((pytester.path / ".pytest_cache/d/skiagraph").iterdir())) == 1
