"""When the time given for a run is over."""

from typing import Final

_FIRST_PAIR_NS: Final = 10_000_000_000
"""A limited run allows this much for the first pair: learning the clock takes a second, the first use of OpenCV another."""


def patience_s(wait_s: float | None, seconds: float) -> float | None:
    """Return how long to wait for an absent board, s; None: for ever.

    Args:
        wait_s: what was asked for; None: nothing.
        seconds: how long the run may take from its first pair, s; 0: no limit. A limited run must end without a board, too.
    """
    return wait_s if wait_s is not None or not seconds else seconds + _FIRST_PAIR_NS / 1e9


class TimeLimit:
    """Counts a run's time from its first pair.

    Args:
        limit_ns: how long the run may take; 0: no limit.
    """

    def __init__(self, limit_ns: int) -> None:
        self._limit_ns = limit_ns
        self._met_ns = 0

    def is_over(self, now_ns: int, *, has_met_board: bool, begun_ns: int) -> bool:
        """Whether the time has passed since the first pair, or no pair came for long after the board had.

        Args:
            now_ns: CLOCK_MONOTONIC, ns.
            has_met_board: whether a board has said hello.
            begun_ns: when the first pair was done; 0: none yet.
        """
        if not self._met_ns and has_met_board:
            self._met_ns = now_ns
        if not begun_ns and self._met_ns:
            begun_ns = self._met_ns + _FIRST_PAIR_NS
        return bool(self._limit_ns and begun_ns) and now_ns - begun_ns >= self._limit_ns
