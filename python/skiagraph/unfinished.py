"""What an interrupted run leaves behind."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from .bridge import is_bridge

_SCHEMA = "skiagraph.unfinished-run/1"


def remove_unfinished(out: str | os.PathLike[str]) -> bool:
    """Removes the finished seeds of an interrupted run of a tracker in this process, which nothing may resume.

    What another command left is kept: skiagraph refuses to go on with it. False if another process is writing there.
    """
    place = Path(os.path.abspath(out))
    partial = place.with_name(place.name + ".partial")
    if _is_locked(place.with_name(f".{place.name}.lock")):
        return False
    if _is_of_bridge(partial):
        shutil.rmtree(partial)
    return True


def _is_of_bridge(partial: Path) -> bool:
    try:
        settings: dict[str, Any] = json.loads((partial / "settings.json").read_text(encoding="utf-8"))
        command = settings["run"]["--exec"]
        is_ours = settings["schema"] == _SCHEMA and is_bridge(command)
    except (OSError, ValueError, KeyError, TypeError):
        return False
    # nothing of the user's is removed
    known = re.compile(r"settings\.json|writing|.*seed-\d+")
    return is_ours and not partial.is_symlink() and all(known.fullmatch(path.name) for path in partial.iterdir())


def _is_locked(path: Path) -> bool:
    """Whether a running program has locked a file."""
    try:
        with path.open("r+b") as file:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
                with suppress(OSError):
                    msvcrt.locking(file.fileno(), msvcrt.LK_UNLCK, 1)
            else:
                import fcntl

                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False
