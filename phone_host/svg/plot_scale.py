"""The numbers of a plot: round tick marks, durations as text, scales from values to pixels. Pure."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
"""(N,) float64; NaN = no measurement."""

_UNITS: Final = ((1e9, "s"), (1e6, "ms"), (1e3, "µs"), (1.0, "ns"))


def duration_unit(ns: float) -> tuple[float, str]:
    """Choose the unit in which a duration has one to three digits before its decimal point.

    Args:
        ns: the duration, ns; its sign does not matter.

    Returns:
        The unit in ns, and its symbol.
    """
    return next(((unit, name) for unit, name in _UNITS if abs(ns) >= unit), _UNITS[-1])


def duration_text(ns: float) -> str:
    """Write a duration with three significant digits and its unit; a dash for NaN, 0 for zero."""
    if math.isnan(ns):
        return "\u2013"
    if ns == 0.0:
        return "0"
    # 999.6 µs would round to four digits, so it becomes a millisecond.
    unit, name = duration_unit(float(f"{ns:.3g}"))
    value = ns / unit
    digits = max(0, 2 - math.floor(math.log10(max(1.0, abs(float(f"{value:.3g}"))))))
    return f"{value:.{digits}f}\u202f{name}"


def ticks(low: float, high: float, count: int) -> list[float]:
    """Choose round numbers (1, 2 or 5 times a power of ten apart) inside an interval: the numbers, ascending; never more than `count` + 2."""
    rough = (high - low) / max(1, count)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def number_text(value: float) -> str:
    """Write a tick's number without needless digits."""
    return f"{value:.6g}".replace("-", "\u2212")


@dataclass(frozen=True, slots=True, kw_only=True)
class Linear:
    """A linear scale: `low` maps to `start_px`, `high` to `end_px`."""

    low: float
    high: float
    start_px: float
    end_px: float

    def px(self, value: float) -> float:
        """Return a value's position; values outside the scale go to the nearer end."""
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return self.start_px + share * (self.end_px - self.start_px)


@dataclass(frozen=True, slots=True, kw_only=True)
class Log:
    """A logarithmic scale of positive numbers; zero and negative values go to its start."""

    low: float
    high: float
    start_px: float
    end_px: float

    def px(self, value: float) -> float:
        """Return a value's position; values outside the scale go to the nearer end."""
        inside = min(max(value, self.low), self.high)
        share = math.log(inside / self.low) / math.log(self.high / self.low)
        return self.start_px + share * (self.end_px - self.start_px)

    def decades(self) -> list[float]:
        """Return the powers of ten on the scale, which must consist of whole decades."""
        first, last = round(math.log10(self.low)), round(math.log10(self.high))
        return [10.0**power for power in range(first, last + 1)]


def log_scale(values: Values, start_px: float, end_px: float) -> Log:
    """Make a logarithmic scale in whole decades that holds all positive values; 1 µs to 1 ms if there are none.

    Args:
        values: ns.
        start_px: where it begins.
        end_px: where it ends.
    """
    positive = values[np.isfinite(values) & (values > 0.0)]
    if not positive.size:
        return Log(low=1e3, high=1e6, start_px=start_px, end_px=end_px)
    low = math.floor(math.log10(float(positive.min())))
    high = max(low + 1, math.ceil(math.log10(float(positive.max()))))
    return Log(low=10.0**low, high=10.0**high, start_px=start_px, end_px=end_px)


def span(values: Values) -> tuple[float, float]:
    """Return the least and the greatest finite value; (0, 1) if there is none, one apart if all are equal."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high > low else (low, low + 1.0)
