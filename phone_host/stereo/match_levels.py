"""Finds how the grey levels of a pair's right image differ from the left one's, from pixels that show the same thing.

The two views never show quite the same, so mean and deviation of whole images say nothing certain about the cameras.
Here a rough disparity tells which pixels belong together, and robust fits through their levels leave the wrong ones out:
first one gain and offset, then, where it explains the levels clearly better, a gain that changes over the image. Lenses
darken towards their corners, lamps shine from one side, and surfaces gloss: real rigs differ by 10 to 20 % across an
image.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image

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

LEAST_SPREAD: Final = 2.0
"""Grey levels: with a lower standard deviation a gain cannot be measured."""

ROUNDS: Final = 8
"""Of reweighting at most; gain and offset stand to three digits by then."""

SETTLED_LEVELS: Final = 0.02
"""Grey levels: a round that changes no level by more is the last; levels are whole numbers."""

CAUCHY_SCALES: Final = 2.0
"""Residuals of two robust standard deviations count half (Cauchy's weight)."""

FIELD_GAIN: Final = 0.85
"""The field must lower the median residual by 15 %; on pairs of one good camera it lowers it by 5 % and changes nothing."""

RIDGE: Final = 0.02
"""Share of the mean information that pulls the field's numbers to 0 where no pixel speaks."""

MOST_CHANGE: Final = 0.4
"""The field changes the gain by at most this share: at the corners it may be extrapolated."""

OFFSET_UNIT: Final = 50.0
"""Grey levels: brings the offset to the size of the field's other unknowns, so that one ridge fits all."""

HIGH_PASS_PX: Final = 15
"""Window of the mean that `without_levels` subtracts, px."""

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
        height, width = image.shape
        x = np.linspace(-1, 1, width, dtype=np.float32)[np.newaxis]
        y = np.linspace(-1, 1, height, dtype=np.float32)[:, np.newaxis]
        a, b, c, d, e = (np.float32(value) for value in self.field)
        change = (c * x + a) * x + (e * y + b + d * x) * y
        gain = np.float32(self.gain) * (1 + np.clip(change, -MOST_CHANGE, MOST_CHANGE))
        changed = image * gain + np.float32(self.offset_levels)
        return np.asarray(np.clip(np.rint(changed), 0, 255), np.uint8)


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
    linear = LevelField(gain=gain, offset_levels=offset)
    return linear if here.size < LEAST_FOR_FIELD else _with_field(linear, here, there, x, y)


def _corresponding(left: Image, right: Image, disparity: Disparity) -> tuple[Values, Values, Values, Values]:
    """Return levels left and right of evenly chosen corresponding pixels, and where in the right image they lie, -1 to 1."""
    height, width = left.shape
    place = np.flatnonzero(disparity <= np.arange(width, dtype=np.float32))  # NaN is at no place
    if place.size > MOST_PIXELS:
        place = place[np.arange(MOST_PIXELS) * place.size // MOST_PIXELS]
    row, column = np.divmod(place, width)
    x, y = (column - disparity.reshape(-1)[place]).astype(np.float32), row.astype(np.float32)
    here = _local_means(left).reshape(-1)[place]
    there = here[:0] if place.size == 0 else _seen_at(_local_means(right), x, y)
    used = np.minimum(here, there) > BLACKEST
    used &= np.maximum(here, there) < WHITEST
    a, b, u, v = (np.asarray(values[used], np.float64) for values in (here, there, x, y))
    return a, b, u / max(width - 1, 1) * 2 - 1, v / max(height - 1, 1) * 2 - 1


def _local_means(image: Image) -> NDArray[np.float32]:
    return np.asarray(cv2.boxFilter(image, cv2.CV_32F, (WINDOW_PX, WINDOW_PX)), np.float32)


def _seen_at(image: NDArray[np.float32], x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.float32]:
    seen = cv2.remap(image, x[np.newaxis], y[np.newaxis], cv2.INTER_LINEAR)
    return np.asarray(seen, np.float32).reshape(-1)


def _weights(residuals: Values) -> Values:
    scale = 1.4826 * float(np.median(np.abs(residuals))) + 0.5  # half a level: rounding
    return 1 / (1 + (residuals / (CAUCHY_SCALES * scale)) ** 2)


def _line(here: Values, there: Values) -> tuple[float, float]:
    """Fit here = gain * there + offset; both have noise, so the gain is the ratio of their spreads (reduced major axis)."""
    gain = float(here.std() / there.std())
    offset = float(here.mean() - gain * there.mean())
    for _ in range(ROUNDS):
        weight = _weights(here - (gain * there + offset))
        weight /= weight.sum()
        middle_here, middle_there = float(weight @ here), float(weight @ there)
        spread_there = float(weight @ (there - middle_there) ** 2)
        if spread_there <= 0:
            break
        before = gain * middle_there + offset, gain
        gain = float(np.sqrt(weight @ (here - middle_here) ** 2 / spread_there))
        offset = middle_here - gain * middle_there
        # The line turns about the middle; 128 levels from there is the farthest that matters.
        if abs(middle_here - before[0]) + 128 * abs(gain - before[1]) < SETTLED_LEVELS:
            break
    return gain, offset


def _with_field(linear: LevelField, here: Values, there: Values, x: Values, y: Values) -> LevelField:
    """Add a gain that changes over the image, if it explains the levels clearly better."""
    level = linear.gain * there
    rest = here - (level + linear.offset_levels)
    unknowns = np.column_stack(
        [*(shape * level for shape in (x, y, x * x, x * y, y * y, 1.0)), np.full(x.size, OFFSET_UNIT)]
    )
    found = np.zeros(unknowns.shape[1])
    for _ in range(ROUNDS):
        weighted = unknowns * _weights(rest - unknowns @ found)[:, np.newaxis]
        information = weighted.T @ unknowns
        information += np.eye(found.size) * (RIDGE * np.trace(information) / found.size)
        found = np.linalg.solve(information, weighted.T @ rest)
    left_over = float(np.median(np.abs(rest - unknowns @ found)))
    middle = 1 + float(found[5])
    if left_over > FIELD_GAIN * float(np.median(np.abs(rest))) or middle <= 0:
        return linear
    a, b, c, d, e = (float(value) / middle for value in found[:5])
    return LevelField(
        gain=linear.gain * middle,
        offset_levels=linear.offset_levels + OFFSET_UNIT * float(found[6]),
        field=(a, b, c, d, e),
    )
