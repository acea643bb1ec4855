"""Finds where in time two cameras saw the same, among all offsets at which their recordings overlap. Pure.

At each offset the one camera's rates are regressed on the other's: how the cameras are turned to each other, and how much more the one sees
move, need not be known. What the offset explains is weighed as evidence: -n/2 log(1 - R²) nats, n being the number of independent moments.
Source: Bartlett 1946, on the theoretical specification of sampling properties of autocorrelated time series (for n).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.recording.sight import QUANTITIES, Rates, Series, Sight, Times, rates_at

Floats = NDArray[np.float64]

LEAST_S: Final = 5.0
"""Least overlap: shorter ones fit by chance."""

_CHANCE_NATS: Final = 25.0
"""What the best of thousands of offsets reaches by chance: 16 coefficients give 8 on average."""

_MARGIN_NATS: Final = 15.0
"""The best offset must be better by this than chance, and than any other."""

_RIVAL: Final = 0.75
"""An offset with this share of the best one's evidence is another answer: what moves has nearly repeated itself."""

_MOST_S: Final = 300.0
"""What of the one recording is looked for in the other: more would drift apart by more than a movement lasts."""

LOBE_S: Final = 1.0
"""A movement is told from the next one within this: offsets that fit nearly as well as the best lie closer to it."""

_NOTHING: Final = 1e-6
_LEAST_SIGHT: Final = np.array([0.5, 0.5, 0.02, np.inf])
"""What must be surpassed by the spread of some rate, or else nothing moved: px of the small image per s, and logarithm of brightness per s."""


class Unclear(Enum):
    """Why recordings do not tell their offset."""

    STILL_FIRST = "nothing moves in the first"
    STILL_SECOND = "nothing moves in the second"
    STRANGE = "nothing that moves is in both"
    REPEATED = "what moves repeats itself"
    SHORT = "too short"


@dataclass(frozen=True, slots=True)
class Found:
    """An offset.

    Attributes:
        offset_s: time of the first recording minus that of the second, for one moment, to a period.
        nats: evidence for it over the next best, if as much of that overlapped.
    """

    offset_s: float
    nats: float


def search_offset(first: Sight, second: Sight, within_s: tuple[float, float] | None = None) -> Found | Unclear:
    """Find the offset between two recordings, to about a period.

    Args:
        first: what the one camera saw.
        second: what the other camera saw.
        within_s: the least and the greatest offset that are possible; None: any.
    """
    step_s = max(first.period_s, second.period_s)
    grids = [_grid(sight, step_s) for sight in (first, second)]
    if min(map(len, grids)) * step_s < LEAST_S:
        return Unclear.SHORT
    rates = [rates_at(sight, grid, step_s) for sight, grid in zip((first, second), grids, strict=True)]
    for each, unclear in zip(rates, (Unclear.STILL_FIRST, Unclear.STILL_SECOND), strict=True):
        if not each.known.any() or not (_spread(each) > _LEAST_SIGHT).any():
            return unclear
    begin = _busiest(rates[1], round(_MOST_S / step_s))
    piece = slice(begin, begin + round(_MOST_S / step_s))
    lags, nats, count = _evidence(
        rates[0], Rates(rates[1].values[piece], rates[1].slopes[piece], rates[1].known[piece]), step_s
    )
    offsets_s = grids[0][0] - grids[1][begin] + lags * step_s
    if within_s is not None:
        chosen = (offsets_s >= within_s[0] - step_s) & (offsets_s <= within_s[1] + step_s)
        offsets_s, nats, count = offsets_s[chosen], nats[chosen], count[chosen]
    return _decided(offsets_s, nats, count)


def _grid(sight: Sight, step_s: float) -> Times:
    return np.arange(sight.at_s[0], sight.at_s[-1], step_s, dtype=np.float64)


def _spread(rates: Rates) -> Floats:
    spread: Floats = rates.values[rates.known].std(axis=0)
    return spread


def _busiest(rates: Rates, length: int) -> int:
    """Return where the piece of a length begins in which most moves."""
    if len(rates.known) <= length:
        return 0
    scaled = rates.values / (_spread(rates) + _NOTHING)
    summed = np.concatenate([[0.0], np.cumsum((scaled**2).sum(axis=1))])
    return int(np.argmax(summed[length:] - summed[:-length]))


def _evidence(first: Rates, second: Rates, step_s: float) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return the lags with enough overlap, ascending, the evidence for each, nats, and how many moments overlap."""
    x, y = _scaled(first), _scaled(second)
    length = 1 << (len(x) + len(y)).bit_length()
    lags = np.arange(-len(y) + 1, len(x))

    def spectra(series: Floats) -> NDArray[np.complex128]:
        return np.fft.rfft(series, length, axis=0)

    def summed(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> Floats:
        full = np.fft.irfft(one * other.conj(), length, axis=0)
        return full[lags % length]

    mask_x, mask_y = spectra(first.known.astype(float)), spectra(second.known.astype(float))
    in_x, in_y, squares_y = spectra(x), spectra(y), spectra(y**2)
    count = summed(mask_x, mask_y)
    enough = count * step_s >= LEAST_S
    lags, count = lags[enough], np.maximum(count, 1.0)[enough]
    if not len(lags):
        return lags, np.empty(0), count
    mean_x = np.stack([summed(in_x[:, i], mask_y) for i in range(QUANTITIES)], axis=1) / count[:, None]
    mean_y = np.stack([summed(mask_x, in_y[:, i]) for i in range(QUANTITIES)], axis=1) / count[:, None]
    power_y = np.stack([summed(mask_x, squares_y[:, i]) for i in range(QUANTITIES)], axis=1) / count[:, None]
    squares = np.empty((len(lags), QUANTITIES, QUANTITIES))
    products = np.empty_like(squares)
    for i in range(QUANTITIES):
        for j in range(QUANTITIES):
            products[:, i, j] = summed(in_x[:, i], in_y[:, j]) / count
            if j <= i:
                squares[:, i, j] = squares[:, j, i] = summed(spectra(x[:, i] * x[:, j]), mask_y) / count
    squares -= mean_x[:, :, None] * mean_x[:, None, :]
    products -= mean_x[:, :, None] * mean_y[:, None, :]
    power_y = np.maximum(power_y - mean_y**2, _NOTHING)
    squares += 1e-3 * np.eye(QUANTITIES)  # a quantity that rests explains nothing
    explained = (products * np.linalg.solve(squares, products)).sum(axis=1) / power_y
    independent = count[:, None] / _memory(x, y)
    nats = -0.5 * (independent * np.log1p(-np.clip(explained, 0.0, 0.999))).sum(axis=1)
    return lags, np.asarray(nats), count


def _scaled(rates: Rates) -> Series:
    """Return rates in units of their spread, around 0; those of a quantity that rests stay 0."""
    values = rates.values - rates.values[rates.known].mean(axis=0)
    return np.asarray(values / np.maximum(_spread(rates), _NOTHING) * rates.known[:, None], np.float64)


def _memory(x: Series, y: Series) -> Floats:
    """Return for each quantity of y over how many moments it and x remember, (4,): Bartlett's sum of both autocorrelations' products."""
    of_x, of_y = _autocorrelation(x), _autocorrelation(y)
    length = min(len(of_x), len(of_y))
    sums = 2 * np.einsum("ki,kj->ij", of_x[:length], of_y[:length]) - 1
    return np.asarray(np.maximum(sums.max(axis=0), 1.0))


def _autocorrelation(series: Series) -> Series:
    length = 1 << (2 * len(series)).bit_length()
    power = np.abs(np.fft.rfft(series, length, axis=0)) ** 2
    full = np.fft.irfft(power, length, axis=0)[: len(series) // 2]
    return np.asarray(full / np.maximum(full[0], _NOTHING))


def _decided(offsets_s: Times, nats: Floats, count: Floats) -> Found | Unclear:
    """Return the best offset, if no other explains nearly as much of as many moments.

    An offset at which less overlaps is no worse for that: what repeats itself would be joined where most of it overlaps.
    """
    if not len(nats):
        return Unclear.STRANGE
    best = int(np.argmax(nats))
    excess = (nats - _CHANCE_NATS) * (count[best] / count)
    if excess[best] < _MARGIN_NATS:
        return Unclear.STRANGE
    rivals = np.flatnonzero(excess > min(_RIVAL * excess[best], excess[best] - _MARGIN_NATS))
    near = int(rivals[-1] - rivals[0]) == len(rivals) - 1 and offsets_s[rivals[-1]] - offsets_s[rivals[0]] < LOBE_S
    if not near:
        return Unclear.REPEATED
    away = np.abs(offsets_s - offsets_s[best]) > LOBE_S
    return Found(float(offsets_s[best]), float(excess[best] - (excess[away].max() if away.any() else 0.0)))
