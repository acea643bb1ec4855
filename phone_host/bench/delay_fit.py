"""Models propagation as latency + bytes / rate: a line fitted to frames of different size. Pure.

The line has least absolute deviations, i.e. it estimates the median delay for each size (Koenker and Bassett,
"Regression Quantiles", Econometrica 46, 1978). A frame delayed by a hundred times the usual weighs no more than one
delayed a little. Intervals come from the moving-block bootstrap (Künsch, "The jackknife and the bootstrap for general
stationary observations", Annals of Statistics 17, 1989): delays of neighbouring frames are correlated, so drawing
single frames would give intervals that are too narrow. Neither the latency nor the time per byte may be negative. If
noise tilts the line that far, the result is the best line through the origin, or the best horizontal line.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

LIKE_SIZES: Final = 1.2
"""Frames within this factor count as one size: a line through them would be extrapolated too far, down to 0 bytes."""

_STEPS: Final = 60

_DRAWS: Final = 200

_MOST: Final = 1200
"""Beyond this, points are thinned evenly: more do not change the line, and the bootstrap draws them 200 times."""

_BLOCK: Final = 15
"""Neighbours drawn together: half a second at 30 frames a second, longer than a hitch of the machine."""

_TRIES: Final = 20
"""Tries per draw. If these do not find two sizes, only one frame differs from the rest and no interval is possible."""

_LEAST_BLOCKS: Final = 8
"""A short series has smaller blocks, so that it has this many. Else all draws would be equal and the interval empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DelayFit:
    """delay = latency + ns_per_byte * bytes, with intervals that contain the true line in 95 % of such measurements.

    Attributes:
        latency_ns: delay of 0 bytes, at least 0; NaN if all frames were of about one size.
        latency_low_ns: lower end of its interval; NaN if too few frames were of another size.
        latency_high_ns: upper end of its interval.
        ns_per_byte: slope, at least 0; NaN if all frames were of about one size.
        slope_low: lower end of its interval, ns per byte.
        slope_high: upper end of its interval, ns per byte.
        points: number of frames given.
        typical_error_ns: median absolute residual.
    """

    latency_ns: float
    latency_low_ns: float
    latency_high_ns: float
    ns_per_byte: float
    slope_low: float
    slope_high: float
    points: int
    typical_error_ns: float

    @property
    def bytes_per_s(self) -> float:
        """The rate; infinite if larger frames were not slower, NaN if unknown."""
        return _rate(self.ns_per_byte)

    @property
    def least_bytes_per_s(self) -> float:
        """Lower end of the rate's interval."""
        return _rate(self.slope_high)

    @property
    def most_bytes_per_s(self) -> float:
        """Upper end of the rate's interval; infinite if the size made no certain difference."""
        return _rate(self.slope_low)

    def delay_ns(self, size_bytes: float) -> float:
        """Return the line's delay for a frame of this size, ns."""
        return self.latency_ns + self.ns_per_byte * size_bytes


def fit_delay(size_bytes: Values, delay_ns: Values, draws: int = _DRAWS) -> DelayFit:
    """Fit the line.

    Args:
        size_bytes: (N,) sizes of the frames, in order of arrival.
        delay_ns: (N,) their delays, ns.
        draws: number of bootstrap draws; 0: no intervals (NaN).

    Returns:
        The fit; all NaN if the frames are of about one size (LIKE_SIZES).
    """
    every = max(1, -(-size_bytes.size // _MOST))
    x, y = size_bytes[::every], delay_ns[::every]
    nan = float("nan")
    if x.size < 2 or x.max() < LIKE_SIZES * x.min():
        return DelayFit(
            latency_ns=nan,
            latency_low_ns=nan,
            latency_high_ns=nan,
            ns_per_byte=nan,
            slope_low=nan,
            slope_high=nan,
            points=int(size_bytes.size),
            typical_error_ns=nan,
        )
    latency, slope = _line(x, y)
    left = float(np.median(np.abs(y - latency - slope * x)))
    low: Values = np.full(2, nan)
    high: Values = np.full(2, nan)
    if draws:
        generator = np.random.default_rng(x.size)  # the same data give the same interval
        drawn = np.array([_line(x[chosen], y[chosen]) for chosen in _blocks(x, draws, generator)])
        if len(drawn) == draws:
            low, high = np.asarray(np.percentile(drawn, (2.5, 97.5), axis=0), np.float64)
    return DelayFit(
        latency_ns=latency,
        latency_low_ns=low[0],
        latency_high_ns=high[0],
        ns_per_byte=slope,
        slope_low=low[1],
        slope_high=high[1],
        points=int(size_bytes.size),
        typical_error_ns=left,
    )


def _line(x: Values, y: Values) -> tuple[float, float]:
    """Return intercept and slope of least absolute deviations, neither below zero."""
    latency, slope = _free_line(x, y)
    # The sum of deviations is convex: if its minimum is not allowed, the best allowed line is on the border.
    if slope < 0.0:
        return max(0.0, float(np.median(y))), 0.0
    if latency < 0.0:
        return 0.0, max(0.0, _weighted_median(y / x, x))
    return latency, slope


def _weighted_median(values: Values, weights: Values) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(reached, 0.5 * reached[-1])]])


def _free_line(x: Values, y: Values) -> tuple[float, float]:
    """Return intercept and slope of least absolute deviations, by iteratively reweighted least squares."""
    middle, width = float(x.mean()), float(x.std()) or 1.0
    design = np.stack([np.ones_like(x), (x - middle) / width])
    weights = np.ones_like(y)
    solution: Values = np.zeros(2)
    floor = max(1.0, 1e-6 * float(np.abs(y).max()))
    for _ in range(_STEPS):
        weighted = design * weights
        found: Values = np.asarray(np.linalg.solve(weighted @ design.T, weighted @ y), np.float64)
        if np.abs(found - solution).max() < 1e-3 * floor:
            solution = found
            break
        solution = found
        weights = 1.0 / np.maximum(floor, np.abs(y - solution @ design))
    slope = float(solution[1]) / width
    return float(solution[0]) - slope * middle, slope


def neighbours(size: int, count: int, generator: np.random.Generator) -> NDArray[np.int64]:
    """Draw from a series in moving blocks of neighbours, so that the correlation between neighbours is kept.

    Args:
        size: length of the series, at least 1.
        count: number of indices to draw.
        generator: random generator for the draws.

    Returns:
        (count,) indices into the series.
    """
    block = max(1, min(_BLOCK, size // _LEAST_BLOCKS))
    starts = generator.integers(0, size - block + 1, -(-count // block))
    indices: NDArray[np.int64] = (starts[:, np.newaxis] + np.arange(block)).ravel()[:count]
    return indices


def _blocks(x: Values, draws: int, generator: np.random.Generator) -> list[NDArray[np.int64]]:
    """Return indices of resampled series that contain more than one size."""
    chosen: list[NDArray[np.int64]] = []
    for _ in range(_TRIES * draws):
        if len(chosen) == draws:
            break
        indices = neighbours(x.size, x.size, generator)
        if x[indices].min() < x[indices].max():
            chosen.append(indices)
    return chosen


def _rate(ns_per_byte: float) -> float:
    if np.isnan(ns_per_byte):
        return float("nan")
    return 1e9 / ns_per_byte if ns_per_byte > 0.0 else float("inf")
