"""Measures how irregularly images arrive: the spread of arrival times around a steady pace. Pure."""

from collections import deque
from typing import Final

_WINDOW: Final = 61
"""Two seconds at 30 frames a second, short enough for a camera's clock to be steady."""

_LEAST: Final = 16


class Arrivals:
    """The recent arrivals."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=_WINDOW)

    def add(self, sequence: int, arrived_ns: int) -> None:
        """Take note of an image's arrival and its number in the stream."""
        self._seen.append((sequence, arrived_ns))

    def restart(self) -> None:
        """Take note that the stream begins anew."""
        self._seen.clear()

    @property
    def jitter_ns(self) -> int | None:
        """The images' 95th percentile of lateness relative to the fastest one, ns; None before 16 images.

        Lateness is measured against the least-squares line.
        """
        if len(self._seen) < _LEAST:
            return None
        count = len(self._seen)
        first_sequence, first_ns = self._seen[0]
        points = [(sequence - first_sequence, arrived_ns - first_ns) for sequence, arrived_ns in self._seen]
        middle_x, middle_y = (sum(values) / count for values in zip(*points, strict=True))
        over = sum((x - middle_x) * (y - middle_y) for x, y in points)
        under = sum((x - middle_x) ** 2 for x, _ in points)
        slope = over / under if under else 0.0
        late = sorted(y - slope * x for x, y in points)
        return round(late[count * 95 // 100] - late[0])
