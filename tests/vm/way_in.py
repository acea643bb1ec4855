"""Runs in the guest: whoever dials its port here goes on from a network namespace: `way_in.py NAMESPACE PORT HOST PORT`. Standard library only."""

import ctypes
import socket
import sys
import threading
from contextlib import suppress
from pathlib import Path


def carry(source: socket.socket, target: socket.socket) -> None:
    """Carry bytes until either end is gone; then end both."""
    with suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)
    for end in (source, target):
        with suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)


def serve(listening: socket.socket, target: tuple[str, int]) -> None:
    """Carry every connection on to the target."""
    while True:
        near, _ = listening.accept()
        try:
            far = socket.create_connection(target, 5)
        except OSError:
            near.close()
            continue
        far.settimeout(None)
        for ends in ((near, far), (far, near)):
            threading.Thread(target=carry, args=ends, daemon=True).start()


def main() -> None:
    """Serve until stdin ends. A socket stays in the namespace in which it was made, so the listening one is made before the change."""
    name, port, host, there = sys.argv[1:]
    with socket.create_server(("127.0.0.1", int(port))) as listening:
        with Path("/run/netns", name).open("rb") as namespace:
            if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), 0):
                raise OSError(ctypes.get_errno(), "setns")
        threading.Thread(target=serve, args=(listening, (host, int(there))), daemon=True).start()
        print("ready", flush=True)
        sys.stdin.read()  # ends with the ssh that started this; the namespace must not outlive the test


if __name__ == "__main__":
    main()
