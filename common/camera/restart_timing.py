"""When a camera must be started again so that its exposures come at a wanted phase. Pure.

A webcam whose sensor runs only while it streams takes its first exposure a fixed time after the start. On a loaded board
single stamps and single starts are tens of ms late, so no figure here rests on one of them.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence
from statistics import median
from typing import Final

_FRAMES: Final = 15
_STARTS: Final = 5
"""Each phase is the median of this many frames, the latency the median of this many starts."""


def typical_phase(moments_ns: Sequence[int], period_ns: int) -> int:
    """Return a moment at the phase that most of the moments share.

    Args:
        moments_ns: at least one, ns; the last is near the result.
        period_ns: time between two exposures, > 0.
    """
    last_ns, half_ns = moments_ns[-1], period_ns // 2
    # The median is taken around the circular mean: around a moment that is half a period off, the others would lie at both ends.
    turns = [math.tau * ((moment_ns - last_ns) % period_ns) / period_ns for moment_ns in moments_ns]
    mean = math.atan2(math.fsum(map(math.sin, turns)), math.fsum(map(math.cos, turns)))
    middle_ns = last_ns + round(mean / math.tau * period_ns)
    offs_ns = ((moment_ns - middle_ns + half_ns) % period_ns - half_ns for moment_ns in moments_ns)
    return middle_ns + round(median(offs_ns))


class RestartTiming:
    """Learns from the stamps of a camera's frames how long after a start it exposes."""

    def __init__(self) -> None:
        self._started_ns = 0
        self._first: list[int] = []
        self._recent: deque[int] = deque(maxlen=_FRAMES)
        self._latencies: deque[int] = deque(maxlen=_STARTS)

    def started(self, now_ns: int) -> None:
        """Take note of a start at `now_ns`."""
        self._started_ns = now_ns
        self._first.clear()
        self._recent.clear()

    def exposed(self, stamps_ns: Iterable[int]) -> None:
        """Take note of the middles of exposures, oldest first, ns on the clock of the start."""
        for stamp_ns in stamps_ns:
            self._recent.append(stamp_ns)
            if len(self._first) < _FRAMES:
                self._first.append(stamp_ns)

    def start_for(self, later_ns: int, earliest_ns: int, period_ns: int) -> int | None:
        """Return when to start the camera again so that it exposes `later_ns` later within its period.

        Call it once for each start: the latency of the stream that ends here is added to those of earlier starts.

        Args:
            later_ns: by how much later, in [0, period_ns).
            earliest_ns: no start before this moment.
            period_ns: time between two exposures, > 0.

        Returns:
            The first such moment; None while this stream has shown no frame.
        """
        if not self._first:
            return None
        self._latencies.append(typical_phase(self._first, period_ns) - self._started_ns)
        latency_ns = typical_phase(self._latencies, period_ns)
        start_ns = typical_phase(self._recent, period_ns) + later_ns - latency_ns
        return earliest_ns + (start_ns - earliest_ns) % period_ns
