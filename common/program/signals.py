"""SIGTERM and SIGINT as something a poll loop can wait for. Create it once, in a process's main thread.

A second Ctrl-C ends the process at once: whoever presses it again does not want to wait for the summary.
"""

import signal
import socket
from types import FrameType

from common.program import interrupts


class StopSignals:
    """Catches SIGTERM and SIGINT; `reader` becomes readable with the first one."""

    def __init__(self) -> None:
        self.reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)  # noqa: FBT003 - the standard library's own signature
        self._came: set[int] = set()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._note)
        signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)

    @property
    def stop(self) -> bool:
        """Whether the process was asked to stop."""
        return bool(self._came)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C asked for it."""
        return signal.SIGINT in self._came

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        if number == signal.SIGINT and self.interrupted:
            interrupts.leave()
        self._came.add(number)
