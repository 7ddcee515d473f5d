"""Temporary folders that live as long as an object."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from pathlib import Path


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
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)
