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
_OFF: Final = 0.25
"""Share of a period by which an interval may differ from a multiple of it. Pairs are up to half a period apart."""

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

    def fits(self, stamp_ns: int) -> bool:
        """Take the next stamp.

        Args:
            stamp_ns: when the image was exposed, ns.

        Returns:
            Whether it is plausible.
        """
        trusted_ns, newest_ns, self._newest_ns = self._trusted_ns, self._newest_ns, stamp_ns
        period_ns = self.period_ns
        if newest_ns is not None and stamp_ns > newest_ns:
            missing = 1 if period_ns is None else max(1, round((stamp_ns - newest_ns) / period_ns))
            self._steps_ns.append((stamp_ns - newest_ns) // missing)
        if trusted_ns is None or self._is_multiple(stamp_ns - trusted_ns, period_ns):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return True
        self._doubted += 1
        if self._doubted >= _INSIST and newest_ns is not None and self._is_multiple(stamp_ns - newest_ns, period_ns):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return stamp_ns > trusted_ns
        return False

    @staticmethod
    def _is_multiple(step_ns: int, period_ns: int | None) -> bool:
        if step_ns <= 0 or period_ns is None:
            return step_ns > 0
        return abs(step_ns - max(1, round(step_ns / period_ns)) * period_ns) <= _OFF * period_ns
