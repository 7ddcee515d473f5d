"""Every example that users read runs: docstrings, docs/python.md and the section of README.md."""

import ast
import doctest
import importlib
import importlib.util
import inspect
import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import sysconfig
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


def run_blocks(page):
    """Runs the Python of a page in this folder; a block behind `<!-- needs PACKAGE -->` only if the package is here.
    Returns the packages that are missing.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"(?:<!-- needs ([\w ]+) -->\n)?```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, object] = {"__name__": page}
    missing: set[str] = set()
    for needs, block in blocks:
        lacks = {package for package in needs.split() if not importlib.util.find_spec(package)}
        if not lacks:
            exec(compile(block, page, "exec"), names)
        missing |= lacks
    assert blocks
    return missing


@pytest.mark.usefixtures("with_set")
def test_python_of_the_tour_runs():
    assert run_blocks("docs/tour.md") == set()


# snippets needed the files of a checkout, which a wheel does not have; webdataset leaves its shards open
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning", "ignore::ResourceWarning")
@pytest.mark.parametrize("page", ["docs/python.md", "docs/coming-from.md"])
def test_python_of_a_page_runs_in_an_empty_folder(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # too large for every check
    assert run_blocks(page) <= {"torch", "Pose2Sim", "opensim"} or "CI" not in os.environ


@pytest.mark.parametrize("checker", [["mypy", "--strict", "--no-incremental"], ["pyright"]], ids=["mypy", "pyright"])
def test_types_of_the_pages_are_clean(checker, tmp_path):
    if shutil.which(checker[0], path=sysconfig.get_path("scripts")) is None:
        pytest.skip(f"there is no {checker[0]}")
    notebook = json.loads((ROOT / "docs/tutorials/first_report.ipynb").read_text(encoding="utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    (tmp_path / "notebook.py").write_text("\n".join(cells), encoding="utf-8")
    for page in ("python", "coming-from"):
        # what needs other packages has their types, if any
        blocks = re.findall(r"(?<! -->\n)```python\n(.*?)```", (ROOT / f"docs/{page}.md").read_text("utf-8"), re.DOTALL)
        (tmp_path / f"{page.replace('-', '_')}.py").write_text("\n".join(blocks), encoding="utf-8")
    files = [path.name for path in tmp_path.glob("*.py")]
    program = Path(sysconfig.get_path("scripts"), checker[0])
    package = str(Path(skiagraph.__file__).parents[1])
    (tmp_path / "pyrightconfig.json").write_text(json.dumps({"extraPaths": [package]}))
    environment = {**os.environ, "MYPYPATH": package} if "site-packages" not in package else None
    more = ["--pythonpath", sys.executable] if checker[0] == "pyright" else []
    said = subprocess.run(
        [program, *checker[1:], *more, *files], cwd=tmp_path, capture_output=True, text=True, env=environment
    )
    assert said.returncode == 0, said.stdout
