"""Paths that users give."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path

from .errors import InputError

#: A path as text or as a :class:`pathlib.Path`.
PathName = str | PathLike[str]


def given(path: PathName, what: str) -> str:
    """The path as it was given.

    Raises:
        InputError: it is no path; the message begins with `what`.
    """
    name = fspath(path) if isinstance(path, (str, PathLike)) else path
    if not isinstance(name, str) or not name or "\0" in name:
        raise InputError(f"{what}: expected a path as text or pathlib.Path, found {type(path).__name__} {path!r:.80}")
    return name


def absolute(path: PathName, what: str) -> Path:
    """The absolute path, which stays the same place when the working folder changes; errors as :func:`given`.

    >>> absolute("sets/walk", "set") == Path.cwd() / "sets/walk"
    True
    """
    return Path(given(path, what)).absolute()


def shown(path: Path) -> Path:
    """The path from the working folder if it is below it, as tables name runs by the paths they are given.

    >>> shown(absolute("runs/mine", "run")).as_posix()
    'runs/mine'
    """
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) and path != here else path
