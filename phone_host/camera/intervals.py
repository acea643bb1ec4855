"""Judges the intervals between a camera's stamps. Pure.

A camera exposes at its own even pace, and whole images may be missing. So an interval is a multiple of the period. A stamp
that was taken late, because the machine was busy, fits none: its image would be paired with one of another moment.
"""

from collections import deque
from statistics import median
from typing import Final

_RECENT: Final = 9
"""The period is the median of so many intervals: it follows a camera that slows down in dim light within ten images."""

_LEAST: Final = 3
EVEN: Final = 0.25
"""Share of a period by which an interval may differ from a multiple of it. Pairs are up to half a period apart."""

COARSE: Final = 0.45
"""The same for stamps that count in coarse steps: Firefox's go in steps of 11.6 ms (blocks of its audio clock)."""

_INSIST: Final = 3
"""So many stamps in a row that fit none before them, but each other, are the camera's new pace."""


class Intervals:
    """The recent stamps of one camera."""

    def __init__(self) -> None:
        self._steps_ns: deque[int] = deque(maxlen=_RECENT)
        self._newest_ns: int | None = None
        self._trusted_ns: int | None = None
        self._doubted = 0

    @property
    def period_ns(self) -> int | None:
        """Time between two images, ns; None before four of them."""
        return round(median(self._steps_ns)) if len(self._steps_ns) >= _LEAST else None

    @property
    def unevenness_ns(self) -> int:
        """How far recent intervals are from each other, ns."""
        return max(self._steps_ns) - min(self._steps_ns) if self._steps_ns else 0

    def fits(self, stamp_ns: int, off: float = EVEN) -> bool:
        """Take the next stamp.

        Args:
            stamp_ns: when the image was exposed, ns.
            off: share of a period by which an interval may differ from a multiple of it.

        Returns:
            Whether it is plausible.
        """
        trusted_ns, newest_ns, self._newest_ns = self._trusted_ns, self._newest_ns, stamp_ns
        period_ns = self.period_ns
        if newest_ns is not None and stamp_ns > newest_ns:
            missing = 1 if period_ns is None else max(1, round((stamp_ns - newest_ns) / period_ns))
            self._steps_ns.append((stamp_ns - newest_ns) // missing)
        if trusted_ns is None or self._is_multiple(stamp_ns - trusted_ns, period_ns, off):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return True
        self._doubted += 1
        step_ns = 0 if newest_ns is None else stamp_ns - newest_ns
        if self._doubted >= _INSIST and self._is_multiple(step_ns, period_ns, off):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return stamp_ns > trusted_ns
        return False

    @staticmethod
    def _is_multiple(step_ns: int, period_ns: int | None, off: float) -> bool:
        if step_ns <= 0 or period_ns is None:
            return step_ns > 0
        return abs(step_ns - max(1, round(step_ns / period_ns)) * period_ns) <= off * period_ns
