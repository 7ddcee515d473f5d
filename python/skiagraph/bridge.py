"""Stands for a tracker that runs in another process: passes lines between skiagraph and that process.

skiagraph starts this file as the tracker's program. It uses the standard library alone, so that it starts quickly.
"""

import os
import socket
import sys
import threading
from contextlib import suppress

#: Variable with port and password of the process that has the tracker.
VARIABLE = "_SKIAGRAPH_TRACKER"


#: Variables with the Python of that process, and the path of this file: the command that starts it is the same in all
#: environments, so that a baseline does not depend on where they are.
PYTHON, FILE = "_SKIAGRAPH_PYTHON", "_SKIAGRAPH_BRIDGE"


def is_bridge(text: str) -> bool:
    """Whether a command, or a text with one, is that of a tracker in a process of Python."""
    return FILE in text or "skiagraph\\bridge.py" in text


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
    # the other side may have ended first
    with suppress(OSError):
        while chunk := os.read(0, 1 << 16):
            peer.sendall(chunk)
        peer.shutdown(socket.SHUT_WR)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        sys.exit(f"the process with the tracker has gone: {error}")
    # at once, as the thread may still wait for a line, which Python cannot interrupt
    os._exit(0)
