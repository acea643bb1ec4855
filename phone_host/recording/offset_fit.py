"""Measures offset and drift between two recordings of the same to a small part of a period, with its uncertainty. Pure.

The second camera's rates are those of the first at a shifted time, mixed by a matrix that is found as well: least squares, Newton's steps.
How strongly the misfit pulls back when it is moved is measured, not computed: the noise of the first camera's slopes would pretend to know more.
The uncertainty comes from the scatter of the pull over windows of time, so it holds whatever the noise is, if that forgets within a window.
Source: White 1982, Maximum likelihood estimation of misspecified models; Welch 1967, modified periodograms (the soft window); Fisher 1925, expansion of Student's distribution.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.recording.sight import QUANTITIES, Rates, Sight, Times, rates_at

Floats = NDArray[np.float64]

_STEP: Final = 0.5
"""Moments a period."""

_BIN_S: Final = 0.1
_WINDOW_S: Final = 2.0
"""Hands and heads move for about half as long. Sharp blocks stated a quarter too much: what the first camera sees more strongly than the second for
a while pulls to and fro, which a soft window lets cancel (bench_joining)."""

_FITTED: Final = 4.0
"""Degrees of freedom that offset and drift take, and about as many the mixing. With 2, 92.5 % of 10 s were within their 95 %."""

_DRIFT: Final = 60e-6
"""Sigma of the drift that two crystals may have against each other."""

_START_S: Final = 60.0
_ROUNDS: Final = 8
_ENOUGH: Final = 0.02
"""A step of so many sigmas is the last."""

_ASIDE: Final = 0.25
"""How far aside the pull is measured again, in periods."""

_LEAST_BEND: Final = 0.1
_NORMAL_95: Final = 1.959964


@dataclass(frozen=True, slots=True)
class Offset:
    """The offset between two recordings.

    Attributes:
        at_s: time of the second recording at which it holds.
        offset_s: time of the first recording minus that of the second.
        drift: its change per s.
        uncertainty_s: half-width that holds the true offset in 95 %, there.
        drift_uncertainty: the same of the drift.
        overlap_s: for how long both recordings tell something.
        worst_s: half-width that holds the true offset in 95 % at the ends of the overlap, where the drift tells most.
        likeness: share of the second camera's changes that the first one's explain, of that quantity where it is greatest, 0 to 1.
    """

    at_s: float
    offset_s: float
    drift: float
    uncertainty_s: float
    drift_uncertainty: float
    overlap_s: float
    worst_s: float
    likeness: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pull:
    """How the misfit pulls offset and drift.

    Attributes:
        bins: (B, 2) the pull of each tenth of a second.
        shares: (B, 2, 2) its share of the curvature, if slopes were exact.
        weights: (4,) of the quantities.
        likeness: see Offset.
    """

    bins: Floats
    shares: Floats
    weights: Floats
    likeness: float


@dataclass(frozen=True, slots=True, eq=False)
class _Matter:
    """What is fitted.

    Attributes:
        first: what the first camera saw.
        seen: the second camera's rates.
        moments: (M,) their times, s.
        middle_s: from where drift counts.
        bell_s: how they are smoothed.
    """

    first: Sight
    seen: Rates
    moments: Times
    middle_s: float
    bell_s: float

    @property
    def away_s(self) -> Times:
        """How long after the middle each moment is, (M,), s."""
        return self.moments - self.middle_s

    def pull(self, offset_s: float, drift: float, reach_s: float, weights: Floats | None = None) -> _Pull:
        """Return the pull at an offset and drift, of all moments within reach of the middle."""
        offsets = offset_s + drift * self.away_s
        clock = self.first.at_s - np.interp(self.first.at_s, self.moments + offsets, offsets)
        moved = rates_at(Sight(clock, self.first.totals), self.moments, self.bell_s)
        use = moved.known & self.seen.known & (np.abs(self.away_s) <= reach_s)
        return _pull(moved.values[use], moved.slopes[use], self.seen.values[use], self.away_s[use], weights)


def _pull(values: Floats, slopes: Floats, seen: Floats, away_s: Times, weights: Floats | None) -> _Pull:
    design = np.column_stack([values, np.ones(len(values))])
    target = (seen - seen.mean(axis=0)) / np.maximum(seen.std(axis=0), 1e-9)
    mixing = np.linalg.lstsq(design, target, rcond=1e-6)[0]
    left = target - design @ mixing
    if weights is None:
        weights = np.asarray(1 / np.maximum(left.var(axis=0), 1e-6))
    place = ((away_s - away_s[0]) // _BIN_S).astype(np.int64)
    count = int(place[-1]) + 1
    pulls, shares = np.zeros((count, 2)), np.zeros((count, 2, 2))
    for quantity, weight in enumerate(weights):
        turn = slopes @ mixing[:QUANTITIES, quantity]
        moves = np.column_stack([turn, turn * away_s])
        moves -= design @ np.linalg.lstsq(design, moves, rcond=1e-6)[0]  # what another mixing would do as well
        for i in range(2):
            pulls[:, i] += np.bincount(place, weight * moves[:, i] * left[:, quantity], count)
            for j in range(2):
                shares[:, i, j] += np.bincount(place, weight * moves[:, i] * moves[:, j], count)
    return _Pull(pulls, shares, weights, float(1 - left.var(axis=0).min()))


def fit_offset(first: Sight, second: Sight, start_s: float) -> Offset:
    """Measure the offset.

    Args:
        first: what the one camera saw.
        second: what the other camera saw.
        start_s: the offset to a period: time of the first minus time of the second.
    """
    bell_s = max(first.period_s, second.period_s)
    begin, end = max(second.at_s[0], first.at_s[0] - start_s), min(second.at_s[-1], first.at_s[-1] - start_s)
    moments = np.arange(begin, end, bell_s * _STEP, dtype=np.float64)
    seen = rates_at(second, moments, bell_s)
    matter = _Matter(first, seen, moments, float(moments[seen.known].mean()), bell_s)
    answer = np.array([start_s, 0.0])
    reach_s, most_s = _START_S, float(np.abs(matter.away_s).max())
    answer, sigmas, pulled = _solved(matter, answer, reach_s)
    while reach_s < most_s:  # from the middle outward, so that a drift never grows to more than a movement lasts
        reach_s *= 2
        answer, sigmas, pulled = _solved(matter, answer, reach_s)
    wide = student_95(_freedom(pulled.shares[:, 0, 0]) - _FITTED)
    return Offset(
        at_s=matter.middle_s,
        offset_s=float(answer[0]),
        drift=float(answer[1]),
        uncertainty_s=wide * float(sigmas[0]),
        drift_uncertainty=wide * float(sigmas[1]),
        overlap_s=float(end - begin),
        worst_s=wide * math.hypot(float(sigmas[0]), float(sigmas[1]) * most_s),
        likeness=pulled.likeness,
    )


def _solved(matter: _Matter, answer: Floats, reach_s: float) -> tuple[Floats, Floats, _Pull]:
    """Return offset and drift for all within reach of the middle, the standard deviations of both, and the last pull."""
    step, sigmas, pulled = _step(matter, answer, reach_s)
    for _ in range(_ROUNDS):
        answer = np.asarray(answer + step)
        if abs(step[0]) < _ENOUGH * sigmas[0]:
            break
        step, sigmas, pulled = _step(matter, answer, reach_s)
    return answer, sigmas, pulled


def _step(matter: _Matter, answer: Floats, reach_s: float) -> tuple[Floats, Floats, _Pull]:
    """Return the step to a better offset and drift, the standard deviations of both, and the pull."""
    offset_s, drift = float(answer[0]), float(answer[1])
    pulled = matter.pull(offset_s, drift, reach_s)
    aside_s = _ASIDE * matter.bell_s
    before, behind = (
        matter.pull(offset_s + sign * aside_s, drift, reach_s, pulled.weights).bins[:, 0].sum() for sign in (-1, 1)
    )
    curved = pulled.shares.sum(axis=0)
    curved *= np.clip((before - behind) / (2 * aside_s) / max(curved[0, 0], 1e-30), _LEAST_BEND, 1.0)
    smooth = np.column_stack([np.convolve(one, _bell(), "full") for one in pulled.bins.T])
    scatter = smooth.T @ smooth
    # A moment's neighbours tell the same. The scatter knows that; what is known of crystals has to be weighed alike.
    alike = scatter[0, 0] / max(curved[0, 0], 1e-30)
    prior = np.diag([0.0, alike / _DRIFT**2])
    inverse = np.linalg.inv(curved + prior)
    step = inverse @ (pulled.bins.sum(axis=0) - prior @ answer)
    spread = inverse @ (scatter + alike * prior) @ inverse
    return step, np.sqrt(np.diag(spread)), pulled


def _bell() -> Floats:
    """Return the window over which pulls are summed; its squares sum to 1."""
    window = np.hanning(round(_WINDOW_S / _BIN_S) + 2)[1:-1]
    return np.asarray(window / math.sqrt(float((window**2).sum())))


def _freedom(shares: Floats) -> float:
    """Return of how many independent sums the scatter is the mean."""
    alike = np.correlate(_bell(), _bell(), "full") ** 2
    return float(
        shares.sum() ** 2 / (shares * np.convolve(shares, alike, "full")[len(alike) // 2 :][: len(shares)]).sum()
    )


def student_95(freedom: float) -> float:
    """Return the half-width that holds 95 % of Student's t, in standard deviations.

    Args:
        freedom: degrees of freedom; fewer than 2 count as 2.
    """
    z, n = _NORMAL_95, max(freedom, 2.0)
    terms = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    return z + sum(term / n ** (power + 1) for power, term in enumerate(terms))
