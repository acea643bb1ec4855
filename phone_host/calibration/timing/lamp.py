"""Measures the time offset with a lamp or LED that is switched on and off in view of both cameras.

Each change of brightness gives one moment per camera: where the straight line between the samples before and after it
crosses the middle between dark and bright. With samples one period apart, such a moment is off by up to half a period.
If the lamp does not keep step with the camera, it is off as often early as late, so the mean over many changes has no
bias, whatever the exposure time. A lamp that blinks regularly may keep step, and no image would show it; such a lamp is
refused.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.words import counted
from phone_host.calibration.timing.shots import SIGMAS, Measured, Method, Times, period_s, require_shots, rolling_s
from phone_host.model import Image, TimeOffset

CELLS: Final = (12, 9)
"""Columns and rows of cells into which the image is divided: a lamp in a corner would be lost in the mean of a whole image."""

_LEAST_STEP: Final = 4.0
"""Grey levels between dark and bright in the brightest cell. Less may be mains flicker or automatic exposure."""

_LEAST_EDGES: Final = 8
_IRREGULAR: Final = 3.0
"""Pauses between changes must differ by this many periods. Each end is seen to within a period, so even equal pauses differ by up to two."""

_MOST_PAUSES: Final = (10, 90)
"""Percentiles of the pauses that are compared. Pauses around a change that fell into a gap of the frames are longer, even with a regular lamp."""

_SEARCH_S: Final = 0.5
"""No camera with its driver is later than another by more than this."""

_LOW, _HIGH = 0.35, 0.65
_REMEDY: Final = "switch a lamp in view of both cameras on and off some twenty times, at irregular moments"


@dataclass(frozen=True, slots=True, eq=False)
class Brightness:
    """What one camera saw.

    Attributes:
        times_s: (N,) stamps.
        cells: (N, C) float64 mean grey level of each cell.
    """

    times_s: Times
    cells: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Signal:
    """The lamp alone: 0 dark, 1 bright; and the row of the image in which it is seen."""

    times_s: Times
    values: NDArray[np.float64]
    row: float


def brightness(image: Image) -> NDArray[np.float64]:
    """Return the mean grey levels of the cells of an image, (C,) float64.

    Args:
        image: (H, W) or (H, W, 3), uint8.
    """
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.asarray(cv2.resize(grey, CELLS, interpolation=cv2.INTER_AREA), dtype=np.float64).ravel()


def measure_lamp(board: Brightness, host: Brightness) -> Measured:
    """Measure the time offset.

    Args:
        board: what the board's camera saw.
        host: what the host's camera saw.

    Raises:
        DataError: the recording is too short, no lamp was seen, or there were too few changes.
    """
    require_shots(len(board.times_s), len(host.times_s))
    left, right = _lamp(board, "board"), _lamp(host, "host")
    offsets = np.arange(-_SEARCH_S, _SEARCH_S, 0.002)
    misfits = np.array([_misfit(left, right, offset) for offset in offsets])
    coarse_s = float(offsets[int(misfits.argmin())])
    periods = period_s(left.times_s), period_s(right.times_s)
    edges = _edges(left), _edges(right)
    differences = _match(*edges, coarse_s, max(periods))
    if len(differences) < _LEAST_EDGES:
        raise DataError(
            f"only {counted(len(differences), 'change')} of the lamp {'was' if len(differences) == 1 else 'were'} seen by both cameras",
            _REMEDY,
        )
    pauses_s = np.diff([moment for moment, _ in edges[0]])
    if np.ptp(np.percentile(pauses_s, _MOST_PAUSES)) < _IRREGULAR * max(periods):
        raise DataError("the lamp blinks regularly and may keep step with the cameras", _REMEDY)
    uncertainty_s = SIGMAS * float(differences.std(ddof=1)) / math.sqrt(len(differences))
    uncertainty_s += rolling_s(left.row, periods[0]) + rolling_s(right.row, periods[1])
    offset = TimeOffset(round(float(differences.mean()) * 1e9), max(1, round(uncertainty_s * 1e9)))
    return Measured(offset, Method.LAMP, len(differences), offsets, misfits, "difference of brightness, RMS")


def _lamp(seen: Brightness, whose: str) -> _Signal:
    """Return the course that all cells share (first principal component), scaled to 0 and 1."""
    centred = seen.cells - np.median(seen.cells, axis=0)
    _, _, ways = np.linalg.svd(centred, full_matrices=False)
    way = ways[0] * (1.0 if ways[0].sum() >= 0 else -1.0)
    course = centred @ way
    dark, bright = (float(level) for level in np.percentile(course, (5, 95)))
    step = (bright - dark) * float(np.abs(way).max())
    if step < _LEAST_STEP:
        raise DataError(
            f"the {whose}'s camera saw no lamp go on and off (brightness changed by {step:.1f} of 255)", _REMEDY
        )
    rows = np.repeat(np.arange(CELLS[1]), CELLS[0])
    row = float(((rows + 0.5) * way**2).sum() / (way**2).sum() / CELLS[1])
    return _Signal(seen.times_s, (course - dark) / (bright - dark), row)


def _misfit(left: _Signal, right: _Signal, offset_s: float) -> float:
    moments = left.times_s + offset_s
    inside = (moments >= right.times_s[0]) & (moments <= right.times_s[-1])
    if inside.sum() < 0.5 * len(moments):
        return math.inf
    there = np.interp(moments[inside], right.times_s, right.values)
    return float(np.sqrt(np.mean((there - left.values[inside]) ** 2)))


def _edges(signal: _Signal) -> list[tuple[float, bool]]:
    """Return the moments of the changes, and whether it became bright. A change across a gap in the frames is left out: it could be anywhere."""
    longest_s = 1.7 * period_s(signal.times_s)
    edges: list[tuple[float, bool]] = []
    times, values = signal.times_s, signal.values
    is_bright = bool(values[0] > 0.5)
    crossing = math.nan
    for before, after in zip(range(len(times) - 1), range(1, len(times)), strict=True):
        low, high = values[before], values[after]
        if (low <= 0.5) != (high <= 0.5):
            share = (0.5 - low) / (high - low)
            gap_s = times[after] - times[before]
            crossing = float(times[before] + share * gap_s) if gap_s <= longest_s else math.nan
        now_bright = bool(high > (_LOW if is_bright else _HIGH))
        if now_bright is not is_bright:
            is_bright = now_bright
            if not math.isnan(crossing):
                edges.append((crossing, is_bright))
    return edges


def _match(left: list[tuple[float, bool]], right: list[tuple[float, bool]], coarse_s: float, period: float) -> Times:
    """Return the differences of the changes that both cameras saw, right minus left."""
    pairs = []
    for moment, brighter in left:
        near = [other for other, its in right if its is brighter and abs(other - moment - coarse_s) < 1.6 * period]
        if len(near) == 1:  # two changes within a period or two could be confused
            pairs.append((moment, near[0]))
    return np.array([there - here for here, there in pairs])
