"""Tells when other programs read a file: `python -m tests.support.file_reads FILE` prints CLOCK_MONOTONIC, ns, and the events since the line before (Linux, inotify).

A process of its own, and before all others where that is allowed, so that nothing delays it: readings that wait are told as one (inotify(7)).
"""

import ctypes
import os
import struct
import sys
import time
from contextlib import suppress
from typing import Final

_ACCESS: Final = 1
_EVENT: Final = struct.Struct("iIII")
"""struct inotify_event without its name: inotify(7)."""


def main(path: str) -> None:
    """Watch until killed."""
    libc = ctypes.CDLL(None, use_errno=True)
    watcher = libc.inotify_init()
    if watcher < 0 or libc.inotify_add_watch(watcher, os.fsencode(path), _ACCESS) < 0:
        raise OSError(ctypes.get_errno(), path)
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    print("ready", flush=True)
    while True:
        events = os.read(watcher, 4096)
        print(time.monotonic_ns(), len(events) // _EVENT.size, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
