"""Completes the holes that a matcher leaves, from what lies around them and from the edges of the left image: `--complete`. Pure.

Completed values are guesses for the eye. They come beside the disparity, marked, and nothing that measures takes them.

From each pixel of a hole one looks left, right, up and down for the next value. Two opposite values that fit one surface give the point on the
line between them. Otherwise a near and a far surface meet in the hole:

- on a row, with the near one to the right: as many pixels beside it as the two disparities differ are hidden from the right
  camera, so they are the far surface, for certain;
- elsewhere the far one is taken, unless the image has an edge on the way to it and none on the way to the near one.

Of row and column, the one wins whose values are nearer and behind fewer edges. Where less than two of the four ways
lead to a value, nothing is known, and the hole stays.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Completed, Disparity, Epipolar, Image
from phone_host.stereo.match_input import grey
from phone_host.stereo.stacked import lying, upright_again

STEP_PX: Final = 1.0
SLOPE: Final = 0.1
"""Two values belong to one surface if they differ by no more than STEP_PX and SLOPE px for each pixel between them. Slopes of 0.05 and 0.2 gave
results within half a per cent of each other on the scenes of decision 0002."""

NOISE_LEVELS: Final = 2
"""Differences between neighbours up to this are no edge, grey levels."""

EDGE_LEVELS: Final = 20.0
"""So many levels of edges on the way divide a value's weight by e. 10 and 40 gave the same within a third of a per cent."""

CLEAR_LEVELS: Final = 10.0
"""An edge on the way to the far surface must be higher by this than twice all edges on the way to the near one, to give a pixel to that."""

ONE_SIDED: Final = 0.5
"""Weight of a line with a value at one end only."""

REACH_SHARE: Final = 0.25
"""A pixel whose nearest value is farther away than this share of the image's longer side stays open."""

LEAST_ENDS: Final = 2
"""A hole in which one way alone leads to a value may be anything: a corner, or the margin that only one camera sees."""

ISLAND_SHARE: Final = 0.002
ALONE_PX: Final = 8
"""Values that holes surround, twice as wide as this, on less than this share of the image (600 px of 640x480), are specks as often as surfaces: no hole is completed from them."""

MEDIAN_PX: Final = 5
"""Rows and columns decide alone; a median over their neighbours takes out the streaks."""

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Way:
    """The way from each hole's pixel to the next value in one direction; (P,) each.

    Attributes:
        value_px: NaN: none.
        steps_px: how far, px.
        edges: sum of the image's steps on the way, grey levels.
    """

    value_px: Floats
    steps_px: Floats
    edges: Floats

    @property
    def known(self) -> Mask:
        """Whether it leads to a value."""
        return np.asarray(np.isfinite(self.value_px), np.bool_)

    def or_else(self, other: "_Way", chosen: Mask) -> "_Way":
        """Return this way where it is chosen, else the other."""
        return _Way(
            value_px=np.where(chosen, self.value_px, other.value_px),
            steps_px=np.where(chosen, self.steps_px, other.steps_px),
            edges=np.where(chosen, self.edges, other.edges),
        )


def completed(left: Image, disparity: Disparity, epipolar: Epipolar = Epipolar.LEFT) -> Completed:
    """Complete the holes of a disparity map.

    Args:
        left: the rectified left image, (H, W) grey or (H, W, 3) BGR, uint8.
        disparity: (H, W) float32, px, NaN = none.
        epipolar: which way the pair's epipolar lines run.

    Returns:
        The map with completed holes, and which pixels were completed; all others have the bits that came in.
    """
    levels, known_px = lying(grey(left), epipolar), lying(disparity, epipolar)
    if not np.isfinite(known_px).any():
        return Completed(disparity=disparity.copy(), mask=np.zeros(disparity.shape, np.bool_))
    guess = _without_streaks(known_px, _guessed(levels, _without_islands(known_px)))
    filled = upright_again(np.where(np.isnan(known_px), guess, known_px), epipolar)
    mask = np.isnan(disparity) & np.isfinite(filled)
    return Completed(disparity=np.where(mask, filled, disparity), mask=mask)


def _without_islands(disparity: Disparity) -> Disparity:
    """Return the disparity without small isolated areas; as it is, if it has no others."""
    known = np.isfinite(disparity)
    beside = cv2.dilate(known.astype(np.uint8), np.ones((2 * ALONE_PX + 1, 2 * ALONE_PX + 1), np.uint8))
    count, area_of = cv2.connectedComponents(beside, connectivity=8)
    is_small = np.bincount(np.asarray(area_of)[known], minlength=count) < ISLAND_SHARE * disparity.size
    is_small[0] = False  # the holes
    islands = is_small[np.asarray(area_of)]
    return disparity if (islands | ~known).all() else np.where(islands, np.float32(np.nan), disparity)


def _guessed(levels: Image, disparity: Disparity) -> Disparity:
    """Return the disparity with a guess in each pixel of a hole that has one."""
    holes = np.isnan(disparity)
    to_left, to_right = _ways(levels, disparity)
    to_top, to_bottom = (_turned(way, holes) for way in _ways(levels.T, disparity.T))
    hidden = to_left.known & ~_one_surface(to_left, to_right)
    hidden &= (to_right.value_px > to_left.value_px) & (to_right.steps_px <= to_right.value_px - to_left.value_px + 1)
    row, row_weight = _along(to_left, to_right, hidden)
    column, column_weight = _along(to_top, to_bottom, np.zeros_like(hidden))
    by_row = np.isnan(column) | (row_weight > column_weight) | ((row_weight == column_weight) & (row < column))
    guess = np.where(hidden, to_left.value_px, np.where(by_row, row, column))
    ways = (to_left, to_right, to_top, to_bottom)
    ends = np.count_nonzero([way.known for way in ways], axis=0)
    nearest_px = np.min([np.where(way.known, way.steps_px, np.inf) for way in ways], axis=0)
    guess[(ends < LEAST_ENDS) | (nearest_px > REACH_SHARE * max(disparity.shape))] = np.nan
    full = disparity.copy()
    full[holes] = guess
    return full


def _ways(levels: NDArray[np.uint8], disparity: Disparity) -> tuple[_Way, _Way]:
    """Look from each pixel of a hole, in the order of rows, to the left and to the right."""
    height, width = disparity.shape
    column = np.arange(width, dtype=np.int32)
    known = np.isfinite(disparity)
    before = np.maximum.accumulate(np.where(known, column, np.int32(-1)), axis=1)
    after = np.minimum.accumulate(np.where(known, column, np.int32(width))[:, ::-1], axis=1)[:, ::-1]
    steps = np.abs(np.diff(levels.astype(np.int32), axis=1))
    climbed = np.zeros((height, width), np.int32)
    np.cumsum(np.maximum(steps - NOISE_LEVELS, 0), axis=1, out=climbed[:, 1:])
    y, x = np.nonzero(~known)

    def way(end: NDArray[np.int32]) -> _Way:
        there = np.clip(end, 0, width - 1)
        return _Way(
            value_px=np.where(end == there, disparity[y, there], np.float32(np.nan)),
            steps_px=np.abs(end - x).astype(np.float32),
            edges=np.abs(climbed[y, x] - climbed[y, there]).astype(np.float32),
        )

    return way(before[y, x]), way(after[y, x])


def _turned(way: _Way, holes: Mask) -> _Way:
    """Bring a way over columns into the order of rows."""
    width = holes.shape[1]
    x, y = np.nonzero(holes.T)
    order = np.argsort(y.astype(np.int64) * width + x, kind="stable")
    return _Way(value_px=way.value_px[order], steps_px=way.steps_px[order], edges=way.edges[order])


def _one_surface(one: _Way, other: _Way) -> Mask:
    """Whether the values at both ends fit one surface; False where one is missing."""
    apart = np.abs(one.value_px - other.value_px)
    return np.asarray(apart <= STEP_PX + SLOPE * (one.steps_px + other.steps_px), np.bool_)


def _along(one: _Way, other: _Way, is_far: Mask) -> tuple[Floats, Floats]:
    """Return what a line says of each pixel, NaN = nothing, and the weight of that.

    Args:
        one: the way to one end.
        other: the way to the other end.
        is_far: pixels that are known to be the far surface.
    """
    both, joined = one.known & other.known, _one_surface(one, other)
    one_is_far = one.value_px <= other.value_px
    far, near = one.or_else(other, one_is_far), other.or_else(one, one_is_far)
    to_near = ~is_far & (2 * near.edges + CLEAR_LEVELS < far.edges)
    taken = near.or_else(far, to_near).or_else(one.or_else(other, one.known), both)
    share = one.steps_px / (one.steps_px + other.steps_px)
    between = one.value_px + (other.value_px - one.value_px) * share
    steps_px = np.where(joined, np.minimum(one.steps_px, other.steps_px), taken.steps_px)
    edges = np.where(joined, np.minimum(one.edges, other.edges), taken.edges)
    weight = np.exp(-edges / EDGE_LEVELS) / steps_px * np.where(both, 1.0, ONE_SIDED)
    return np.where(joined, between, taken.value_px), np.asarray(weight, np.float32)


def _without_streaks(disparity: Disparity, guess: Disparity) -> Disparity:
    """Take the median around each completed pixel, except beside what stays open."""
    unknown = np.isnan(guess)
    averaged = cv2.medianBlur(np.where(unknown, np.float32(0), guess), MEDIAN_PX)
    beside = cv2.dilate(unknown.astype(np.uint8), np.ones((MEDIAN_PX, MEDIAN_PX), np.uint8)).astype(np.bool_)
    return np.where(np.isnan(disparity) & ~beside, averaged, guess)
