"""Brings the host's end of a line in the guest to a pseudo terminal on this machine, where the host's program runs."""

import os
import pty
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from tests.vm.guest import Guest

_FAR_END: Final = Path(__file__).with_name("far_end.py")
_IDLE_S: Final = 0.01


@contextmanager
def extension(guest: Guest, *far_end: str) -> Iterator[str]:
    """Carry a line's bytes for the length of a block.

    Args:
        guest: where the line ends.
        far_end: arguments of far_end.py.

    Yields:
        The link URI for the host.
    """
    guest.put(_FAR_END, "/srv")
    master, slave = pty.openpty()
    path = os.ttyname(slave)
    os.close(slave)
    os.set_blocking(master, False)
    stop = threading.Event()
    carrier = guest.popen(f"exec python3 -u /srv/{_FAR_END.name} {' '.join(far_end)}")
    threads = [threading.Thread(target=way, args=(carrier, master, stop), daemon=True) for way in (_inwards, _outwards)]
    for thread in threads:
        thread.start()
    try:
        yield f"serial:{path}"
    finally:
        stop.set()
        carrier.kill()
        with carrier:
            for thread in threads:
                thread.join()
        os.close(master)


def _outwards(carrier: "subprocess.Popen[bytes]", master: int, stop: threading.Event) -> None:
    """Copy from the guest to the terminal; what its buffer cannot take waits."""
    assert carrier.stdout is not None
    while not stop.is_set() and (data := os.read(carrier.stdout.fileno(), 65536)):
        while data and not stop.is_set():
            try:
                data = data[os.write(master, data) :]
            except BlockingIOError:
                time.sleep(_IDLE_S)


def _inwards(carrier: "subprocess.Popen[bytes]", master: int, stop: threading.Event) -> None:
    """Copy from the terminal to the guest; a terminal that nobody has open gives EIO."""
    assert carrier.stdin is not None
    while not stop.is_set():
        try:
            data = os.read(master, 65536)
        except OSError:  # no data, or nobody there
            time.sleep(_IDLE_S / 10)
            continue
        with suppress(BrokenPipeError):
            carrier.stdin.write(data)
            carrier.stdin.flush()
