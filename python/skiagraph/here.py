"""Trackers in this process."""

from __future__ import annotations

import os
import select
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from . import bridge
from .errors import InputError
from .executable import check, start, stop, toml
from .tracking import AnyTracker, Frame, converse


def track_here(words: list[str], tracker: AnyTracker, name: str, progress: bool) -> int:
    """Runs the program with a bridge as its tracker, and answers what comes over the bridge."""
    password = os.urandom(16).hex()
    with socket.create_server(("127.0.0.1", 0)) as server:
        command, environment = _command_of_bridge()
        environment[bridge.VARIABLE] = f"{server.getsockname()[1]}:{password}"
        words = [*words, f"--exec={command}", f"settings.tracker={toml(name)}"]
        child = start(words, environment=environment)
        try:
            while (peer := _accepted(server, child)) is not None:
                # skiagraph ends the conversation when a time limit has passed, and records that
                with (
                    suppress(ConnectionError),
                    peer,
                    peer.makefile("r", encoding="utf-8") as requests,
                    peer.makefile("w", encoding="utf-8") as answers,
                ):
                    if requests.read(len(password)) == password:
                        converse(tracker, requests, answers, name, on_frame=_show_progress if progress else None)
                        # processes that were forked meanwhile have the socket too, so that closing it is not enough
                        with suppress(OSError):
                            peer.shutdown(socket.SHUT_RDWR)
            out, said = child.communicate()
        except BaseException as error:
            stop(child, error)
            raise
    try:
        return check(child.returncode, out, said, may=(1,))
    except InputError as error:
        if error.fields.get("kind") != "program":
            raise
        # it is this tracker, not the program that stands for it
        text = f"the tracker {name}: it {error.fields['detail']}"
        last = " / ".join(error.fields["stderr"])
        raise InputError(text + (f"; its last lines: {last}" if last else ""), error.exit_code, error.fields) from None


def _command_of_bridge() -> tuple[str, dict[str, str]]:
    """The command that starts the bridge for the tracker that its setting names, and its variables."""
    file = str(Path(bridge.__file__).absolute())
    if sys.platform == "win32":
        return subprocess.list2cmdline([sys.executable, "-IS", file]) + " {tracker}", {}
    command = f'"${bridge.PYTHON}" -IS "${bridge.FILE}" {{tracker}}'
    return command, {bridge.PYTHON: sys.executable, bridge.FILE: file}


def _accepted(server: socket.socket, child: subprocess.Popen[str]) -> socket.socket | None:
    """The next connection; None if the program has ended."""
    while True:
        ended = child.poll() is not None
        if select.select([server], [], [], 0 if ended else 0.02)[0]:
            peer, _ = server.accept()
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return peer
        if ended:
            return None


def _show_progress(frame: Frame) -> None:
    """A line on standard error."""
    done, frames = frame.index + 1, frame.info.frames
    if done % max(1, frames // 100) == 0 or done == frames:
        end = "\n" if done == frames else ""
        print(f"\rseed {frame.info.seed}: {100 * done // frames} %", end=end, file=sys.stderr, flush=True)
