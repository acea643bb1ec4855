"""What a camera that pushes has given until its reader comes: the newest frame, and what became of all others. A shell around a pipe.

A slow reader never builds up a backlog: a frame that a newer one replaces before it was read is reported as skipped. The
caller's lock protects it.
"""

import os
from contextlib import suppress
from typing import Final

from common.camera.base import Grab, Skipped
from common.frame import Frame

_MOST: Final = 64


class WaitingGrabs:
    """The grabs that wait, and a file descriptor that is readable while there are any."""

    def __init__(self) -> None:
        self._grabs: list[Grab] = []
        self._read_fd, self._write_fd = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._is_open = True

    @property
    def pollable(self) -> int:
        """Readable when something has come, or `tell` was called."""
        return self._read_fd

    def add(self, grab: Grab, next_sequence: int) -> None:
        """Take a grab.

        Args:
            grab: the grab; a frame replaces the one that waits.
            next_sequence: number of the grab that would follow.
        """
        if isinstance(grab, Frame):
            self._skip_waiting()
        self._grabs.append(grab)
        if len(self._grabs) > _MOST:  # nobody reads: merge the old grabs into one Skipped
            *old, newest = self._grabs
            passed = sum(item.frames if isinstance(item, Skipped) else 1 for item in old)
            self._grabs = [Skipped(next_sequence - 1 - passed, passed), newest]
        self.tell()

    def take(self) -> list[Grab]:
        """Return everything that waits."""
        with suppress(BlockingIOError):
            os.read(self._read_fd, 4096)
        grabs, self._grabs = self._grabs, []
        return grabs

    def clear(self) -> None:
        """Forget everything that waits."""
        self._grabs.clear()

    def tell(self) -> None:
        """Wake the reader."""
        if self._is_open:
            with suppress(BlockingIOError):
                os.write(self._write_fd, b"\0")

    def close(self) -> None:
        """Release the file descriptors. May be called again."""
        if self._is_open:
            self._is_open = False
            os.close(self._read_fd)
            os.close(self._write_fd)

    def _skip_waiting(self) -> None:
        """Turn the frame that waits into Skipped, merged with any Skipped just before it."""
        if not (self._grabs and isinstance(waiting := self._grabs[-1], Frame)):
            return
        self._grabs.pop()
        skipped = Skipped(waiting.sequence)
        if self._grabs and isinstance(before := self._grabs[-1], Skipped):
            self._grabs.pop()
            skipped = Skipped(before.sequence, before.frames + 1)
        self._grabs.append(skipped)
