"""Stands for a tracker that runs in another process: passes lines between skiagraph and that process.

skiagraph starts this file as the tracker's program. It uses the standard library alone, so that it starts quickly.
"""

import os
import socket
import subprocess
import sys
import threading

#: Variable with port and password of the process that has the tracker.
VARIABLE = "_SKIAGRAPH_TRACKER"


#: Variables with the Python of that process, and the folder of this package: the command that starts this file is the
#: same in all environments, so that a baseline does not depend on where they are.
PYTHON, SITE = "_SKIAGRAPH_PYTHON", "_SKIAGRAPH_SITE"


def command() -> tuple[str, dict[str, str]]:
    """The command that starts this file, and its variables."""
    variables = {PYTHON: sys.executable, SITE: os.path.dirname(os.path.dirname(os.path.abspath(__file__)))}
    if sys.platform == "win32":
        return subprocess.list2cmdline([sys.executable, "-I", "-S", os.path.abspath(__file__)]), variables
    return f'"${PYTHON}" -I -S "${SITE}/skiagraph/bridge.py"', variables


def is_bridge(text: str) -> bool:
    """Whether a command, or a text with one, is that of a tracker in a process of Python."""
    return "/skiagraph/bridge.py" in text.replace("\\", "/")


def main() -> None:
    """Passes lines both ways until either side ends."""
    port, _, password = os.environ[VARIABLE].partition(":")
    with socket.create_connection(("127.0.0.1", int(port))) as peer:
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.sendall(password.encode())
        threading.Thread(target=_send, args=(peer,), daemon=True).start()
        while chunk := peer.recv(1 << 16):
            while chunk:
                chunk = chunk[os.write(1, chunk) :]


def _send(peer: socket.socket) -> None:
    while chunk := os.read(0, 1 << 16):
        peer.sendall(chunk)
    peer.shutdown(socket.SHUT_WR)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        sys.exit(f"the process with the tracker has gone: {error}")
