"""How long a process did not run although it wanted to: its own absence must not pass for the others' silence. Sans-I/O, `now_ns` passed in.

A program that was stopped or swapped out heard nobody, which says nothing about the others. It looks at its clock no later than the
time at which it asked to be called, so any time beyond that is its own absence. A machine's sleep is not seen here: its clock stood still.
"""

from collections.abc import Callable
from typing import Final

LATE_NS: Final = 1_000_000_000
"""Being called this much too late is not absence but a busy machine. The process looks three times before it believes in silence."""


class Presence:
    """When a process last looked at its clock."""

    def __init__(self) -> None:
        self._looked_ns: int | None = None

    def absent_ns(self, due_ns: Callable[[], int], now_ns: int) -> int:
        """Look at the clock; return how long this process did not run before.

        Args:
            due_ns: gives when it wanted to be called, as of its last look, ns. Called only after a long gap, because this runs for each message.
            now_ns: the clock now, ns.

        Returns:
            Nanoseconds, each reported once; 0 if it was called in time or nearly so; negative if the clock went back by so much.
        """
        looked_ns, self._looked_ns = self._looked_ns, now_ns
        if looked_ns is None or abs(now_ns - looked_ns) <= LATE_NS:
            return 0
        if now_ns < looked_ns:
            return now_ns - looked_ns
        late_ns = now_ns - max(due_ns(), looked_ns)
        return late_ns if late_ns > LATE_NS else 0
