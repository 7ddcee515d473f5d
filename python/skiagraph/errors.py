"""The exceptions of this package; all of them are :class:`SkiagraphError`."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any


class SkiagraphError(Exception):
    """Something failed; where the program refused, the text is its message in the words of this package.

    ``exit_code`` is the program's exit code, or None if the program did not run or was ended by a signal; ``fields``
    are the values of its error (``kind``, ``path``, ``key``, ``argument``, ...), empty if it gave none.
    """

    def __init__(self, message: str, exit_code: int | None = None, fields: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        self.fields = dict(fields or {})


class ProgramError(SkiagraphError):
    """The program is missing, cannot be started, is of another version, or was killed."""


class InputError(SkiagraphError, ValueError):
    """An argument, a file or a setting is wrong; the message says what was found, what is expected and what to do."""


class MissingNameError(InputError, KeyError):
    """There is no array, metric and so on of this name; the message says which there are."""

    __str__ = Exception.__str__

    @classmethod
    def of(cls, kind: str, name: object, known: Iterable[object]) -> MissingNameError:
        """The error of a name that is not among those that are known, with similar ones."""
        import difflib

        names, wanted = [str(each) for each in known], str(name).lower()
        similar = [each for each in names if wanted in each.lower()] or difflib.get_close_matches(wanted, names, 3)
        advice = f"did you mean {' or '.join(similar)}?" if similar else f"there are {', '.join(names)}"
        return cls(f"no {kind} {name!r:.80}; {advice}")


class TrackerError(SkiagraphError):
    """A tracker raised an exception (``__cause__``) or answered something that is no estimate."""


class NoTruthError(SkiagraphError, AttributeError):
    """The set has no ground truth, so :attr:`skiagraph.Set.truth` does not exist."""


class MisreadWarning(UserWarning):
    """An estimate may have been misread, as in other units or axes; the message says what to do."""


class MissingPackageError(SkiagraphError, ImportError):
    """A package of Python is not installed, which this function needs and the others do not."""


def imported(module: str, function: str, package: str | None = None) -> Any:
    """A module of a package that only some functions need."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = package or module.partition(".")[0]
        raise MissingPackageError(f"{function} needs the package {package} (pip install {package}): {error}") from error


@contextmanager
def reading(path: object, expected: str, advice: str = "make it again") -> Iterator[None]:
    """Whatever goes wrong in the block, which reads a file, becomes an error that names the file."""
    try:
        yield
    except SkiagraphError:
        raise
    except Exception as error:
        said = f"it has no {error}" if isinstance(error, KeyError) else " ".join(str(error).split()) or repr(error)
        folder = os.path.dirname(os.path.abspath(getattr(error, "filename", None) or "."))
        said = said if os.path.isdir(folder) else f"{folder} is no folder, or no longer"
        raise InputError(f"{path}: expected {expected}, but {said}; {advice}") from error
