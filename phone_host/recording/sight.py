"""How what a camera sees moves and brightens over time: the little of a recording that tells when another camera saw the same. Pure.

Each quantity is a running total, known at the exposures: shift along and across the image, logarithm of the brightness, and how much changed
altogether. So the rate between any two moments follows without a model of what lies between two frames.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]
"""(N,) s."""

Series = NDArray[np.float64]
"""(N, QUANTITIES)."""

QUANTITIES: Final = 4
_GAP: Final = 3.5
"""A pause of so many periods is one of which nothing is known."""

_REACH: Final = 4.0
"""Sigmas at which a Gaussian bell ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What a camera saw over time.

    Attributes:
        at_s: (N,) exposures, ascending, s.
        totals: (N, 4) shift along x and y, px of the small image; logarithm of the brightness; sum of all change.
    """

    at_s: Times
    totals: Series

    @property
    def period_s(self) -> float:
        """Median time between two exposures, s."""
        return float(np.median(np.diff(self.at_s)))


@dataclass(frozen=True, slots=True, eq=False)
class Rates:
    """Smoothed rates of a sight at moments of equal distance.

    Attributes:
        values: (M, 4) per s; 0 where not known.
        slopes: (M, 4) their change, per s²; 0 where not known.
        known: (M,) whether the camera gave images all around.
    """

    values: Series
    slopes: Series
    known: NDArray[np.bool_]


def rates_at(sight: Sight, moments_s: Times, bell_s: float) -> Rates:
    """Return a sight's rates, smoothed.

    Totals lie on straight lines between exposures: a rate is the mean of an interval, smoothed by a bell. Both act alike before and after, so
    neither shifts anything in time. A bell of a period leaves nothing that would depend on where the exposures lie between the moments.

    Args:
        sight: what a camera saw.
        moments_s: (M,) ascending in steps much shorter than the bell, s.
        bell_s: sigma of the bell, s.
    """
    step_s = float(moments_s[1] - moments_s[0])
    half = max(1, round(_REACH * bell_s / step_s))
    ticks = np.arange(-half, half + 1) * step_s
    bell = np.exp(-0.5 * (ticks / bell_s) ** 2)
    bell *= step_s / (bell.sum() * step_s)
    rising = -ticks / bell_s**2 * bell / step_s  # derivative of the bell: smooths and derives at once
    rising /= -(rising * ticks).sum() * step_s
    turning = (ticks**2 / bell_s**4 - 1 / bell_s**2) * bell / step_s
    turning -= turning.mean()
    turning /= (turning * ticks**2).sum() * step_s / 2
    held = np.column_stack([np.interp(moments_s, sight.at_s, total) for total in sight.totals.T])
    held -= held.mean(axis=0)
    values, slopes = (
        np.column_stack([np.convolve(total, kernel * step_s, "same") for total in held.T])
        for kernel in (rising, turning)
    )
    known = _known(sight, moments_s, half * step_s)
    return Rates(values * known[:, None], slopes * known[:, None], known)


def _known(sight: Sight, moments_s: Times, reach_s: float) -> NDArray[np.bool_]:
    """Return where no gap is within reach, (M,)."""
    at_s = sight.at_s
    known = (moments_s - reach_s > at_s[0]) & (moments_s + reach_s < at_s[-1])
    for before in np.flatnonzero(np.diff(at_s) > _GAP * sight.period_s):
        known &= (moments_s + reach_s < at_s[before]) | (moments_s - reach_s > at_s[before + 1])
    known[: round(reach_s / (moments_s[1] - moments_s[0]))] = False  # there the bell leaves the moments
    known[len(known) - round(reach_s / (moments_s[1] - moments_s[0])) :] = False
    return np.asarray(known, np.bool_)
