"""Finds how the two cameras of a pair differ, levels and vertical position, and undoes it: what our semi-global matchers do first.

Both are measured at half size, along a rough match that needs no equal levels and works at half size or a quarter; each
matcher makes that match itself.

The two views never show quite the same, so mean and deviation of whole images say nothing certain about the cameras.
The rough disparity tells which pixels belong together, and robust fits through their levels leave the wrong ones out:
first one gain and offset, then, where it explains the levels clearly better, a gain that changes over the image. Lenses
darken towards their corners, lamps shine from one side, and surfaces gloss: real rigs differ by 10 to 20 % across an
image.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image, MatchReport
from phone_host.stereo.match_align import LEAST_OFFSET_PX, moved_up, vertical_offset_px

WINDOW_PX: Final = 5
"""Levels are compared as means of such squares: noise, and half a pixel of wrong disparity, average out. Larger ones take
more from a texture that one camera sees compressed than from the same texture in the other."""

BLACKEST, WHITEST = 4, 250
"""Levels beyond these may be cut off, or painted by rectification."""

LEAST_PIXELS: Final = 400
"""Fewer corresponding pixels than a 20 x 20 square say nothing about a whole image."""

LEAST_FOR_FIELD: Final = 2000
"""A gain that changes over the image has five numbers more; five times as many pixels are asked for."""

MOST_PIXELS: Final = 3_000
"""More pixels than this, evenly chosen, do not change the result."""

LOOKED_AT: Final = 6
"""Times as many pixels are looked at for a disparity: where a sixth has one, there are enough."""

LEAST_SPREAD: Final = 2.0
"""Grey levels: with a lower standard deviation a gain cannot be measured."""

ROUNDS: Final = 8
"""Of reweighting at most; gain and offset stand to three digits by then."""

SETTLED_LEVELS: Final = 0.25
"""Grey levels: a round that changes no level by more is the last; levels are whole numbers."""

CAUCHY_SCALES: Final = 2.0
"""Residuals of two robust standard deviations count half (Cauchy's weight)."""

FIELD_GAIN: Final = 0.9
"""The field must lower the median residual by 10 %; on pairs of one good camera it lowers it by 5 % and changes nothing. At
15 % a board before a lamp that needs it was at the edge, and one rough match or another decided."""

HOPELESS_ROUND, HOPELESS = 2, 0.97
"""A field that has gained less than 3 % after two rounds will hardly gain enough."""

RIDGE: Final = 0.002
"""Share of the mean information that pulls the field's numbers to 0 where no pixel speaks. Ten times as much would take a
tenth from a vignetting that is there."""

MOST_CHANGE: Final = 0.4
"""The field changes the gain by at most this share: at the corners it may be extrapolated."""

OFFSET_UNIT: Final = 50.0
"""Grey levels: brings the offset to the size of the field's other unknowns, so that one ridge fits all."""

STRIP_PX: Final = 65_536
"""Pixels that are changed at once: their gains stay in a core's cache."""

HIGH_PASS_PX: Final = 15
"""Window of the mean that `without_levels` subtracts, px."""

GREATEST_GAIN: Final = 8.0
"""A gain above it, or below its reciprocal, is no difference of exposure: such a pair is left alone."""

GRAIN: Final = 2.0**-20
"""Gain, offset and field are multiples of it: the last bits of a processor's sums do not reach the images."""

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelField:
    """A change of levels, gain(x, y) * level + offset_levels.

    Attributes:
        gain: of the middle of the image, above 0.
        offset_levels: grey levels.
        field: x, y, x^2, x y, y^2 from -1 to 1 over the image: relative change of the gain by each; zeros: none.
    """

    gain: float = 1.0
    offset_levels: float = 0.0
    field: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def of(self, image: Image) -> Image:
        """Return the image with changed levels, (H, W) uint8; the image itself if nothing changes."""
        if self == UNCHANGED:
            return image
        if not any(self.field):
            levels = np.arange(256) * self.gain + self.offset_levels
            return np.asarray(cv2.LUT(image, np.clip(np.rint(levels), 0, 255).astype(np.uint8)), np.uint8)
        gains, evened = self._gains(*image.shape), np.empty_like(image)
        offset, step = (self.offset_levels, 0.0, 0.0, 0.0), max(STRIP_PX // image.shape[1], 1)
        for top in range(0, image.shape[0], step):
            rows = slice(top, top + step)
            product = cv2.multiply(image[rows], gains(rows), dtype=cv2.CV_32F)
            evened[rows] = cv2.add(product, offset, dtype=cv2.CV_8U)  # type: ignore[call-overload]  # the stub lacks scalars
        return evened

    @property
    def vignetting_percent(self) -> float:
        """How much greater the gain is at the corners, on average, than in the middle, percent."""
        a, b, c, d, e = self.field
        corners = (c + e + d * x * y + a * x + b * y for x in (-1, 1) for y in (-1, 1))
        return 25 * sum(min(max(corner, -MOST_CHANGE), MOST_CHANGE) for corner in corners)

    @property
    def shading_percent(self) -> float:
        """How much the gain differs between opposite edges, in the direction in which it changes most, percent."""
        return 200 * math.hypot(self.field[0], self.field[1])

    def _gains(self, height: int, width: int) -> Callable[[slice], NDArray[np.float32]]:
        """Return what computes the gains of some rows, (h, W) float32, one operation at a time: processors do not differ."""
        x, y = (np.linspace(-1, 1, size, dtype=np.float32) for size in (width, height))
        a, b, c, d, e = (np.float32(self.gain * value) for value in self.field)
        along, across, twist = (c * x + a) * x + np.float32(self.gain), (e * y + b) * y, d * y
        most = np.float32(MOST_CHANGE * self.gain)
        is_small = sum(abs(value) for value in self.field) <= MOST_CHANGE

        def gains(rows: slice) -> NDArray[np.float32]:
            gain = np.multiply.outer(twist[rows], x)
            gain += across[rows, np.newaxis]
            gain += along
            if not is_small:
                np.clip(gain, np.float32(self.gain) - most, np.float32(self.gain) + most, out=gain)
            return np.asarray(gain, np.float32)

        return gains


UNCHANGED: Final = LevelField()


def without_levels(image: Image) -> Image:
    """Return the image minus its local mean, around 128: a rough match of such images needs no equal levels.

    Args:
        image: (H, W) uint8.

    Returns:
        (H, W) uint8.
    """
    mean = cv2.blur(image, (HIGH_PASS_PX, HIGH_PASS_PX))
    return np.asarray(np.clip(image.astype(np.int16) - mean + 128, 0, 255), np.uint8)


def levels_between(left: Image, right: Image, disparity: Disparity) -> LevelField:
    """Find the change of levels that makes the right image look like the left one.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        disparity: (H, W) float32, px, NaN = none; wrong values do little harm while most are right.

    Returns:
        The change; none if too few pixels correspond or they hold too little contrast.
    """
    here, there, x, y = _corresponding(left, right, disparity)
    if here.size < LEAST_PIXELS or min(float(here.std()), float(there.std())) < LEAST_SPREAD:
        return UNCHANGED
    gain, offset = _line(here, there)
    found = LevelField(gain=gain, offset_levels=offset)
    if here.size >= LEAST_FOR_FIELD:
        found = _with_field(found, here, there, x, y)
    if not 1 / GREATEST_GAIN <= found.gain <= GREATEST_GAIN:
        return UNCHANGED
    a, b, c, d, e = (_whole(value) for value in found.field)
    return LevelField(gain=_whole(found.gain), offset_levels=_whole(found.offset_levels), field=(a, b, c, d, e))


def _whole(value: float) -> float:
    return round(value / GRAIN) * GRAIN


def _corresponding(left: Image, right: Image, disparity: Disparity) -> tuple[Values, Values, Values, Values]:
    """Return levels left and right of evenly chosen corresponding pixels, and where in the right image they lie, -1 to 1.

    A mean taken between two pixels averages both and spreads less. So both images are read between pixels, equally far:
    read at whole pixels on the left only, a fine texture would seem to have 4 % less contrast on the right.
    """
    height, width = left.shape
    step = max(math.isqrt(left.size // (LOOKED_AT * MOST_PIXELS)), 1)
    few = disparity[::step, ::step]
    place = np.flatnonzero(few <= np.arange(0, width, step, dtype=np.float32))  # NaN is at no place
    if place.size > MOST_PIXELS:
        place = place[np.arange(MOST_PIXELS) * place.size // MOST_PIXELS]
    row, column = (step * values for values in np.divmod(place, few.shape[1]))
    x = (column - disparity[row, column]).astype(np.float32)
    first = np.floor(x)
    share = (1 + first - x) / 2  # x + share lies as far before a whole pixel as column + share lies behind one
    here = _between(_local_means(left), row, column, share)
    there = _between(_local_means(right), row, first.astype(np.int64), 1 - share)
    used = np.minimum(here, there) > BLACKEST
    used &= np.maximum(here, there) < WHITEST
    a, b, u, v = (np.asarray(values[used], np.float64) for values in (here, there, x, row))
    return a, b, u / max(width - 1, 1) * 2 - 1, v / max(height - 1, 1) * 2 - 1


def _local_means(image: Image) -> NDArray[np.float32]:
    return np.asarray(cv2.boxFilter(image, cv2.CV_32F, (WINDOW_PX, WINDOW_PX)), np.float32)


def _between(
    image: NDArray[np.float32], row: NDArray[np.int64], column: NDArray[np.int64], share: NDArray[np.floating[Any]]
) -> NDArray[np.float32]:
    """Return the image at column + share, share from 0 to 1; the last column goes on."""
    near, far = image[row, column], image[row, np.minimum(column + 1, image.shape[1] - 1)]
    return np.asarray(near + share * (far - near), np.float32)


def _typical(residuals: Values) -> float:
    """Return the median of the absolute residuals; a thousand of them tell it to 3 %."""
    return float(np.median(np.abs(residuals[:: max(residuals.size // 1000, 1)])))


def _weights(residuals: Values, typical: float) -> Values:
    scale = 1.4826 * typical + 0.5  # half a level: rounding
    return np.asarray(1 / (1 + (residuals / (CAUCHY_SCALES * scale)) ** 2), np.float64)


def _line(here: Values, there: Values) -> tuple[float, float]:
    """Fit here = gain * there + offset."""
    gain, offset = _weighted_line(here, there, np.full(here.size, 1 / here.size))
    for _ in range(ROUNDS):
        before, rest = (gain, offset), here - (gain * there + offset)
        gain, offset = _weighted_line(here, there, _weights(rest, _typical(rest)))
        # The line turns about the middle; no level is farther than 255 from 0.
        if abs(offset - before[1] + 128 * (gain - before[0])) + 128 * abs(gain - before[0]) < SETTLED_LEVELS:
            break
    return gain, offset


def _weighted_line(here: Values, there: Values, weight: Values) -> tuple[float, float]:
    """Fit here = gain * there + offset; both have noise, so the gain is the ratio of their spreads (reduced major axis)."""
    weight = weight / weight.sum()
    middle_here, middle_there = float(weight @ here), float(weight @ there)
    spread_here, spread_there = float(weight @ (here - middle_here) ** 2), float(weight @ (there - middle_there) ** 2)
    gain = math.sqrt(max(spread_here, 1e-6) / max(spread_there, 1e-6))
    return gain, middle_here - gain * middle_there


def _with_field(linear: LevelField, here: Values, there: Values, x: Values, y: Values) -> LevelField:
    """Add a gain that changes over the image, if it explains the levels clearly better.

    Gain and offset come from the line through the evened levels, and only the shape from least squares: these take noise
    for a lower gain.
    """
    unknowns = np.stack([x, y, x * x, x * y, y * y, np.full(x.size, OFFSET_UNIT)])
    changes = unknowns[:5]  # a view: of the right image's levels, by one unit of each number
    changes *= there
    change, gain, offset = np.zeros(5), linear.gain, linear.offset_levels
    rest = here - (gain * there + offset)
    at_first = typical = _typical(rest)
    for number in range(ROUNDS):
        if number == HOPELESS_ROUND and typical > HOPELESS * at_first:
            return linear
        weight = _weights(rest, typical)
        even = there + change @ changes
        gain, offset = _weighted_line(here, even, weight)
        weighted = unknowns * weight
        information = weighted @ unknowns.T
        ridge = RIDGE * float(np.trace(information)) / 6
        wanted = weighted @ ((here - offset) / gain - even) - ridge * np.append(change, 0.0)
        step = np.linalg.solve(information + ridge * np.eye(6), wanted)[:5]
        change += step
        rest = here - (gain * (there + change @ changes) + offset)
        typical = _typical(rest)
        if 255 * gain * float(np.abs(step).sum()) < SETTLED_LEVELS:
            break
    if typical > FIELD_GAIN * at_first:
        return linear
    a, b, c, d, e = (float(value) for value in change)
    return LevelField(gain=gain, offset_levels=offset, field=(a, b, c, d, e))


FACTOR = 2
"""Levels and vertical position are measured at half size."""

LEAST_ROUGH_PX = 15_000
"""The rough match works at half of that size again while this many pixels are left: at a quarter it costs an eighth."""

RoughMatch = Callable[[Image, Image, int], Disparity]
"""Matches two grey images that are reduced by the given factor; px of that size, NaN where the match is not trusted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """How the right image differs from the left one.

    Attributes:
        levels: the change that gives it the left one's levels.
        vertical_px: how far too low it lies, px; 0 where that is too little to be worth a correction.
    """

    levels: LevelField
    vertical_px: float

    def undone(self, right: Image) -> Image:
        """Return the right image with the left one's levels and at its height, (H, W) uint8."""
        right = self.levels.of(right)
        return right if self.vertical_px == 0 else moved_up(right, self.vertical_px)

    def report(self, confidence_histogram: tuple[int, ...] | None = None) -> MatchReport:
        """Return what is told of them; see `MatchReport`."""
        return MatchReport(
            vertical_px=self.vertical_px,
            gain=self.levels.gain,
            offset_levels=self.levels.offset_levels,
            vignetting_percent=self.levels.vignetting_percent,
            shading_percent=self.levels.shading_percent,
            confidence_histogram=confidence_histogram,
        )


def differences(left: Image, right: Image, rough_match: RoughMatch) -> Differences:
    """Measure how the right image differs from the left one.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        rough_match: only has to be right where it has a value.
    """
    small_left, small_right = halved(left), halved(right)
    rough = _rough(small_left, small_right, rough_match)
    height, width = rough.shape
    small_left, small_right = small_left[:height, :width], small_right[:height, :width]
    levels = levels_between(small_left, small_right, rough)
    vertical_px = FACTOR * vertical_offset_px(small_left, levels.of(small_right), rough)
    return Differences(levels=levels, vertical_px=0.0 if abs(vertical_px) < LEAST_OFFSET_PX else vertical_px)


def _rough(left: Image, right: Image, rough_match: RoughMatch) -> Disparity:
    """Match two images of half size, smaller where they are large; the result lacks the last column or row if those are odd."""
    if left.size < 4 * LEAST_ROUGH_PX:
        return rough_match(without_levels(left), without_levels(right), FACTOR)
    rough = 2 * rough_match(without_levels(halved(left)), without_levels(halved(right)), 2 * FACTOR)
    size = (2 * rough.shape[1], 2 * rough.shape[0])
    return np.asarray(cv2.resize(rough, size, interpolation=cv2.INTER_NEAREST), np.float32)


def halved(image: Image) -> Image:
    """Return the image at half size without an odd last column or row: whole squares of four pixels are averaged, which is fast."""
    height, width = (size // 2 * 2 or 1 for size in image.shape)
    return reduced(image[:height, :width], 2)


def reduced(image: Image, factor: int) -> Image:
    """Return the image at a fraction of its size, at least one pixel wide and high; each pixel is the mean of what it covers."""
    height, width = image.shape
    size = (max(width // factor, 1), max(height // factor, 1))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
