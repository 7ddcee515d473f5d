"""Sets that all tests share. The program is the one that $SKIAGRAPH names."""

from pathlib import Path

import pytest

import skiagraph

pytest_plugins = ["pytester"]

#: Small and quick: a third of a second of walking in small images.
SMALL = {"loop_to_s": 0.3, "rig.ring.size_px": [160, 120], "rig.ring.radius_m": 3.5, "calibrate": False}


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A small set with truth images."""
    place = tmp_path_factory.mktemp("sets") / "walk"
    return skiagraph.render("walk", place, {**SMALL, "truth_images": ["depth", "parts"]})


@pytest.fixture
def shipped():
    """The folder of scenarios of the checkout."""
    return Path(__file__).parents[2] / "scenarios"
