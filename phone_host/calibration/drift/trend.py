"""The trend of a departure: a straight line through the estimates since the last change at once. Pure."""

from typing import Final

import numpy as np

from phone_host.calibration.drift.rows import Vector
from phone_host.model import Trend, Turn

_LEAST_S: Final = 20.0
_FEWEST: Final = 8
"""A shorter line follows the noise."""

_MOST: Final = 256
"""Estimates that are kept; when there are more, every second one is forgotten and half as many are kept from then on."""


class Trends:
    """The estimates since the last change at once.

    Args:
        every: of so many estimates one is kept: those that share sightings would agree better than they know.
        least: of time, s, or of whatever else counts; a shorter line follows the noise.
    """

    def __init__(self, every: int = 1, least: float = _LEAST_S) -> None:
        self._every, self._least, self._count = every, least, 0
        self._kept: list[tuple[float, Vector]] = []
        self._every_s = 0.0

    def restart(self) -> None:
        """Forget them."""
        self._kept.clear()
        self._count, self._every_s = 0, 0.0

    def add(self, at_s: float, values: Vector, rows_px: float) -> None:
        """Add an estimate.

        Args:
            at_s: when, s.
            values: (4,) its parameters.
            rows_px: the vertical error it makes, px.
        """
        self._count += 1
        if self._count % self._every or (self._kept and at_s - self._kept[-1][0] < self._every_s):
            return
        self._kept.append((at_s, np.array([*values[:3], rows_px])))
        if len(self._kept) > _MOST:
            self._kept = self._kept[::2]
            self._every_s = (self._kept[-1][0] - self._kept[0][0]) / len(self._kept)

    @property
    def trend(self) -> Trend:
        """The line; NaN where there are too few estimates, or over too short a time."""
        times = np.array([at_s for at_s, _ in self._kept])
        seconds = float(times[-1] - times[0]) if len(times) else 0.0
        if len(times) < _FEWEST or seconds < self._least:
            return Trend(seconds=seconds)
        values = np.array([each for _, each in self._kept])
        from_middle = times - times.mean()
        slopes = from_middle @ values / (from_middle @ from_middle)
        rest = values - values.mean(axis=0) - np.outer(from_middle, slopes)
        sigmas = np.sqrt((rest * rest).sum(axis=0) / (len(times) - 2) / (from_middle @ from_middle))
        return Trend(turn_rad_s=_turn(slopes), sigma_rad_s=_turn(sigmas), rows_px_s=float(slopes[3]), seconds=seconds)


def _turn(values: Vector) -> Turn:
    x, y, z = values[:3].tolist()
    return x, y, z
