"""The signals that end a process (`interrupts.ENDINGS`) as something a poll loop can wait for. Create it once, in a process's main thread.

A second Ctrl-C ends the process at once: whoever presses it again does not want to wait for the summary. A signal that comes
again otherwise is the same request. Where a parent has SIGHUP or SIGQUIT ignored (nohup, a job in a script's background), they stay so.
"""

import signal
import socket
from types import FrameType

from common.program import interrupts


class StopSignals:
    """Catches what ends a process; `reader` becomes readable with the first one."""

    def __init__(self) -> None:
        self.reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)  # noqa: FBT003 - the standard library's own signature
        self._came: set[int] = set()
        for number in interrupts.ENDINGS:
            is_ours = number in {signal.SIGINT, signal.SIGTERM} or signal.getsignal(number) is not signal.SIG_IGN
            if is_ours:
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

    @property
    def hung_up(self) -> bool:
        """Whether the terminal was closed."""
        return signal.SIGHUP in self._came

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        interrupts.forget_terminal()
        if number == signal.SIGINT and self.interrupted:
            interrupts.leave()
        self._came.add(number)
