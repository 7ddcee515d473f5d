"""Stands for a tracker that runs in another process: passes lines between skiagraph and that process.

skiagraph starts this file as the tracker's program. It uses the standard library alone, so that it starts quickly.
"""

import os
import socket
import threading
from contextlib import suppress

#: Variable with port and password of the process that has the tracker.
VARIABLE = "_SKIAGRAPH_TRACKER"

#: Variables with the Python of that process, and the path of this file: the command that starts it is the same in all
#: environments, so that a baseline does not depend on where they are.
PYTHON, FILE = "_SKIAGRAPH_PYTHON", "_SKIAGRAPH_BRIDGE"

#: Exit code with which skiagraph ends the run without results: the tracker has gone, not the pose.
_TRY_AGAIN = 75
_END = b'{"type":"end"}\n'


def main() -> bool:
    """Passes lines both ways until either side ends; whether the tracker has answered all of them."""
    ended = threading.Event()
    port, _, password = os.environ[VARIABLE].partition(":")
    with socket.create_connection(("127.0.0.1", int(port))) as peer:
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.sendall(password.encode())
        threading.Thread(target=_send, args=(peer, ended), daemon=True).start()
        while chunk := peer.recv(1 << 16):
            while chunk:
                chunk = chunk[os.write(1, chunk) :]
    return ended.is_set()


def _send(peer: socket.socket, ended: threading.Event) -> None:
    # the other side may have ended first
    with suppress(OSError):
        last = b""
        while chunk := os.read(0, 1 << 16):
            last = (last + chunk)[-len(_END) :]
            if last == _END:
                ended.set()
            peer.sendall(chunk)
        peer.shutdown(socket.SHUT_WR)


if __name__ == "__main__":
    is_whole = False
    with suppress(OSError):
        is_whole = main()
    # at once, as the thread may still wait for a line, which Python cannot interrupt
    os._exit(0 if is_whole else _TRY_AGAIN)
