"""Paths that users give, and temporary folders that live as long as an object."""

from __future__ import annotations

import os
import re
import weakref
from collections import Counter
from os import PathLike, fspath
from pathlib import Path

from .errors import InputError

_named: Counter[str] = Counter()
_folders: weakref.WeakSet[TemporaryFolder] = weakref.WeakSet()
PathName = str | PathLike[str]


def given(path: PathName, what: str) -> str:
    """The path as it was given."""
    name = fspath(path) if isinstance(path, (str, PathLike)) else path
    if not isinstance(name, str) or not name or "\0" in name:
        raise InputError(f"{what}: expected a path as text or pathlib.Path, found {type(path).__name__} {path!r:.80}")
    return name


def absolute(path: PathName, what: str) -> Path:
    """The absolute path, which stays the same place when the working folder changes; errors as :func:`given`."""
    return Path(given(path, what)).absolute()


class TemporaryFolder:
    """A new folder, which is removed with this object, or at the end of the process."""

    def __init__(self) -> None:
        from tempfile import mkdtemp

        self.path = Path(mkdtemp(prefix="skiagraph-"))
        weakref.finalize(self, _remove, self.path, os.getpid())
        _folders.add(self)


def _remove(folder: Path, owner: int) -> None:
    # a process that was forked has a copy of the object
    if os.getpid() == owner:
        from shutil import rmtree

        rmtree(folder, ignore_errors=True)


def without_temporary(text: str) -> str:
    """A table without the paths of temporary folders: what lies in them has a name of its own."""
    for folder in _folders:
        text = text.replace(f"{folder.path}{os.sep}", "")
    return text


def place(out: PathName | None, name: str, *, force: bool = False) -> tuple[Path, TemporaryFolder | None]:
    """The folder of results: `out`, or a new temporary one with a name of its own, which tables show."""
    if out is not None:
        path = absolute(out, "out")
        if not force and any((path / file).exists() for file in ("run.json", "program.json", "poses.npz")):
            raise InputError(f"{path} has results already; choose another out, or replace them with force=True")
        return path, None
    keep = TemporaryFolder()
    name = re.sub(r"\W+", "_", name).strip("_") or "results"
    _named[name] += 1
    return keep.path / (name if _named[name] == 1 else f"{name}-{_named[name]}"), keep
