"""Positions of a model of OpenSim."""

import re
from pathlib import Path

import numpy as np
import pytest

import skiagraph
import skiagraph.opensim

#: The leg and its motion that the documentation's Python is tested with too.
LEG = (Path(__file__).parents[2] / "tests/cli/own_bodies.rs").read_text(encoding="utf-8")


@pytest.fixture
def files(tmp_path):
    """A leg of two pins, and five frames of it."""
    (tmp_path / "leg.osim").write_text(re.search(r'r#"(.*?)"#', LEG, re.DOTALL)[1])
    rows = "0 0 0\n0.0166667 90 0\n0.0333333 90 -90\n0.05 0 -90\n0.0666667 0 0\n".replace(" ", "\t")
    head = "Coordinates\nversion=1\nnRows=5\nnColumns=3\ninDegrees=yes\nendheader\ntime\thip_flexion_r\tknee_angle_r\n"
    (tmp_path / "leg.mot").write_text(head + rows)
    return tmp_path / "leg.mot", tmp_path / "leg.osim"


def test_positions_are_those_of_the_angles(files):
    pytest.importorskip("opensim", reason="the arrays of the same Python are tested in tests/cli/own_bodies.rs")
    points = skiagraph.opensim.markers(*files)
    assert list(points) == ["hip_r", "knee_r", "ANK"]
    assert np.allclose(points["hip_r"], [0.1, -0.2, 1.0])
    straight, bent = [0.1, -0.2, 0.6], [0.5, -0.2, 1.0]
    assert np.allclose(points["knee_r"], [straight, bent, bent, straight, straight])
    ankle = [[0.1, -0.2, 0.2], [0.9, -0.2, 1.0], [0.5, -0.2, 0.6], [-0.3, -0.2, 0.6], [0.1, -0.2, 0.2]]
    assert np.allclose(points["ANK"], ankle)


def test_files_that_are_none_of_opensim_are_named(files, tmp_path):
    pytest.importorskip("opensim", reason="it is large")
    mot, osim = files
    with pytest.raises(skiagraph.InputError, match=r"none.osim: expected a model of OpenSim"):
        skiagraph.opensim.markers(mot, tmp_path / "none.osim")
    mot.write_text(mot.read_text().replace("knee_angle_r", "elbow"))
    with pytest.raises(skiagraph.InputError, match=r"leg.mot: expected coordinates of this model"):
        skiagraph.opensim.markers(mot, osim)


def test_without_opensim_the_message_says_what_is_missing(files, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "opensim", None)
    with pytest.raises(skiagraph.MissingPackageError, match=r"skiagraph.opensim.markers needs the package opensim"):
        skiagraph.opensim.markers(*files)
