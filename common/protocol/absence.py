"""Silence is not one's own absence: how long a process did not run although it wanted to. Pure.

A program that was stopped, starved or swapped out heard nobody, and that says nothing about the others. As it looks at its clock no later than the
time for which it asked to be called, what passed beyond that is its own absence. A machine that slept is not seen here: its clock stood still.
"""

from typing import Final

LATE_NS: Final = 100_000_000
"""Being called so much later than asked for is no absence: a busy machine's turn of scheduling. Silence is borne for thirty times as long."""


def absent_ns(due_ns: int, now_ns: int) -> int:
    """Give how long this process did not run before now.

    Args:
        due_ns: when it wanted to be called, as of its last look at the clock, ns.
        now_ns: the clock now, ns.

    Returns:
        Nanoseconds; 0 where it came in time, or nearly.
    """
    late_ns = now_ns - due_ns
    return late_ns if late_ns > LATE_NS else 0
