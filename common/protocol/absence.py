"""Silence is not one's own absence: how long a process did not run although it wanted to. Sans-I/O, `now_ns` passed in.

A program that was stopped, or swapped out, heard nobody, and that says nothing about the others. As it looks at its clock no later than the
time for which it asked to be called, what passed beyond that is its own absence. A machine that slept is not seen here: its clock stood still.
"""

from collections.abc import Callable
from typing import Final

LATE_NS: Final = 1_000_000_000
"""Being called so much later than asked for is no absence but a busy machine: it looked three times before silence is believed."""


class Presence:
    """When a process looked at its clock last."""

    def __init__(self) -> None:
        self._looked_ns: int | None = None

    def absent_ns(self, due_ns: Callable[[], int], now_ns: int) -> int:
        """Look at the clock; give how long this process did not run before.

        Args:
            due_ns: gives when it wanted to be called, as of its last look, ns; asked only after a long time, as this is done for each message.
            now_ns: the clock now, ns.

        Returns:
            Nanoseconds, each told once; 0 where it came in time, or nearly.
        """
        looked_ns, self._looked_ns = self._looked_ns, now_ns
        if looked_ns is None or now_ns - looked_ns <= LATE_NS:
            return 0
        late_ns = now_ns - max(due_ns(), looked_ns)
        return late_ns if late_ns > LATE_NS else 0
