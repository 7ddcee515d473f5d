"""The exceptions of this package; all of them are :class:`SkiagraphError`."""

from __future__ import annotations

import importlib
from typing import Any


class SkiagraphError(Exception):
    """Something failed; the text is the program's own message where the program refused.

    ``exit_code`` is the program's exit code, or None if the program did not run or was ended by a signal.
    """

    def __init__(self, message: str, exit_code: int | None = None) -> None:
        super().__init__(message)
        self.exit_code = exit_code


class ProgramError(SkiagraphError):
    """The program is missing, cannot be started, is of another version, or was killed."""


class InputError(SkiagraphError, ValueError):
    """An argument, a file or a setting is wrong; the message says what was found, what is expected and what to do."""


class TrackerError(SkiagraphError):
    """A tracker raised an exception (``__cause__``) or answered something that is no estimate."""


class NoTruthError(SkiagraphError, AttributeError):
    """The set has no ground truth, so :attr:`skiagraph.Set.truth` does not exist."""


class MissingPackageError(SkiagraphError, ImportError):
    """A package of Python is not installed, which this function needs and the others do not."""


def imported(module: str, function: str, package: str | None = None) -> Any:
    """A module of a package that only some functions need.

    Raises:
        MissingPackageError: it is not installed; the message names the function and the package.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = package or module.partition(".")[0]
        raise MissingPackageError(f"{function} needs the package {package} (pip install {package}): {error}") from error
