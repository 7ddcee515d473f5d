"""Runs the notebook of docs/tutorials in an empty folder, and compares what it prints with what it shows.

python tests/site/run_notebook.py [--write]

It needs nbclient, ipykernel, the package skiagraph and its program. --write stores the output.

Only printed text is stored: pictures differ from computer to computer.
"""

import pathlib
import sys
import tempfile

import nbformat
from nbclient import NotebookClient

NOTEBOOK = pathlib.Path(__file__).resolve().parents[2] / "docs" / "tutorials" / "first_report.ipynb"


def printed(notebook):
    """The text that every cell of code prints."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return ["".join(output.text for output in cell.outputs if output.get("name") == "stdout") for cell in cells]


def main():
    shown = nbformat.read(NOTEBOOK, as_version=4)
    expected = printed(shown)
    with tempfile.TemporaryDirectory() as folder:
        # the first cell that fails ends the run with its traceback
        ran = NotebookClient(shown, timeout=120, resources={"metadata": {"path": folder}}).execute()
    found = printed(ran)
    if "--write" in sys.argv:
        for cell in ran.cells:
            cell.metadata = {}
            if cell.cell_type == "code":
                cell.execution_count = None
                cell.outputs = [output for output in cell.outputs if output.get("name") == "stdout"]
        ran.metadata.pop("widgets", None)
        ran.metadata["language_info"] = {"name": "python"}
        nbformat.write(ran, NOTEBOOK)
        return
    for before, after in zip(expected, found, strict=True):
        if before != after:
            sys.exit(f"{NOTEBOOK}: shown is\n{before}\nprinted is\n{after}\n(--write stores it)")
    print(f"{NOTEBOOK.name}: {len(found)} cells run, {sum(map(bool, found))} outputs as shown")


if __name__ == "__main__":
    main()
