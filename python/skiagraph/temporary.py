"""Temporary folders that live as long as an object."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import weakref
from collections import Counter
from pathlib import Path

from .errors import InputError
from .paths import PathName, absolute

_named: Counter[str] = Counter()


class TemporaryFolder:
    """A new folder, which is removed with this object, or at the end of the process.

    >>> folder = TemporaryFolder()
    >>> path = folder.path
    >>> del folder
    >>> path.exists()
    False
    """

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="skiagraph-"))
        weakref.finalize(self, _remove, self.path, os.getpid())


def _remove(folder: Path, owner: int) -> None:
    # a process that was forked has a copy of the object
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def place(out: PathName | None, name: str, *, force: bool = False) -> tuple[Path, TemporaryFolder | None]:
    """The folder of results: `out`, or a new temporary one with a name of its own, which tables show.

    Raises:
        InputError: `out` has results already, which may still be in use.
    """
    if out is not None:
        path = absolute(out, "out")
        if not force and any((path / file).exists() for file in ("run.json", "program.json", "poses.npz")):
            raise InputError(f"{path} has results already; choose another out, or replace them with force=True")
        return path, None
    keep = TemporaryFolder()
    name = re.sub(r"\W+", "_", name).strip("_") or "results"
    _named[name] += 1
    return keep.path / (name if _named[name] == 1 else f"{name}-{_named[name]}"), keep
