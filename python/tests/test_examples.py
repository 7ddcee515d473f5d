"""Every example that users read runs: docstrings, docs/python.md and the section of README.md."""

import ast
import doctest
import importlib
import inspect
import pkgutil
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import skiagraph

MODULES = [f"skiagraph.{module.name}" for module in pkgutil.iter_modules(skiagraph.__path__)]
ROOT = Path(__file__).parents[2]


@pytest.fixture
def with_set(small, tmp_path, monkeypatch):
    """A folder that has sets/walk and the scenarios."""
    shutil.copytree(small.path, tmp_path / "sets" / "walk")
    shutil.copytree(ROOT / "scenarios" / "smoke", tmp_path / "scenarios" / "smoke")
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("with_set")
@pytest.mark.parametrize("name", ["skiagraph", *MODULES])
def test_examples_in_docstrings_run(name):
    names = {name: getattr(skiagraph, name) for name in skiagraph.__all__}
    module = importlib.import_module(name)
    found = doctest.testmod(module, extraglobs=names)
    assert found.failed == 0, "the output above says what differs"


def test_the_page_names_every_function():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    functions = [name for name in skiagraph.__all__ if inspect.isfunction(getattr(skiagraph, name))]
    assert len(functions) > 5
    assert [name for name in functions if f"{name}(" not in page] == []


def test_the_package_repeats_no_names_that_the_program_knows(small):
    result = small.evaluate(small.truth.markers)
    truth = small.truth
    points = (truth.marker_names, truth.joint_names, truth.link_names, truth.angle_names)
    known = {*result.metrics, *result.absent, *np.concatenate(points).tolist()}
    for path in Path(skiagraph.__path__[0]).glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        texts = {
            node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
        assert texts & known == set(), path.name


@pytest.mark.usefixtures("with_set")
@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_python_of_the_pages_runs(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = [block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "skiagraph" in block]
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)
