"""The gates that a view must pass before it is taken, in order, and how fast a board moves between two looks. Pure."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from phone_host.calibration.solve.verdict import REFERENCE_PX
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import BoardLook

Size = tuple[int, int]
"""Width and height, px."""

STILL_NS: Final = 250_000_000
"""So long a board must be still: at the turning point of a movement it is for a moment."""

_STILL_WIDTHS_S: Final = 0.03
"""A still board moves at most so many image widths per second: 19 px/s at 640 px, half a pixel in an exposure of 25 ms.
A hand that rests on something moves by a third of that."""

_STALE_NS: Final = 500_000_000
"""Two looks farther apart than this tell no speed."""

_APART_PX: Final = 0.15
"""The board may move so far between the two exposures of a pair: less than what corners of a good rig err by."""

_BLURRED_PX, _MOST_BLURRED_PX = 4.0, 6.0
"""Edges of sharp boards are 1 to 3 px wide (four real rigs). From 6 px on `failure_modes` calls a series blurred."""

_BLURRED_FACTOR: Final = 1.6
"""A camera that is soft by nature is compared with its own sharpest view."""

_WASHED: Final = 0.05
"""More of the edges may not have lost their contrast: from 0.08 on `failure_modes` calls a series glaring."""

_LEAST_SEEN, _LEAST_CORNERS = 0.3, 12
"""Share and number of a board's corners, for boards of which a part is enough."""

_SAME_PX: Final = 0.5
"""Two cameras at different places never see all corners of a board so close to the same pixels."""

_ALIKE, _SAME_SHAPE = 0.05, 0.006
"""Two views are alike if their corners lie closer than the first on average, and, once brought together, closer than the second, in
image widths. A board that fills 0.4 of the width and turns by 25 degrees in its place changes its shape by 0.009."""

_FAR, _OTHER_SHAPE = 0.15, 0.02
"""Two views teach different things if their corners lie farther apart than the first, or than the second once brought together."""


class Gate(Enum):
    """What became of a view: why it was refused, or that it was taken."""

    NOT_FOUND = "board not found"
    NOT_FOUND_LEFT = "board not found left"
    NOT_FOUND_RIGHT = "board not found right"
    PART = "too few corners"
    SAME = "both cameras show the same picture"
    NOTHING_NEW = "nothing new"
    MOVING = "moving"
    APART = "not the same moment"
    BLURRED = "blurred"
    GLARE = "glare"
    READY = "ready"
    TAKEN = "taken"


NOT_SEEN: Final = frozenset({Gate.NOT_FOUND, Gate.NOT_FOUND_LEFT, Gate.NOT_FOUND_RIGHT, Gate.PART, Gate.SAME})


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Glance:
    """A board in both images of a pair.

    Attributes:
        at_ns: exposure of the pair.
        skew_ns: time between its two exposures.
        left_px: (N, 2) corners; (0, 2): not found; NaN: not seen.
        right_px: the same, right.
        sizes_px: of the left and of the right image.
    """

    at_ns: int
    skew_ns: int
    left_px: Corners
    right_px: Corners
    sizes_px: tuple[Size, Size]


def found(glance: Glance) -> Gate:
    """Return whether both cameras see enough of the board: READY, or why not."""
    match len(glance.left_px) > 0, len(glance.right_px) > 0:
        case False, False:
            return Gate.NOT_FOUND
        case False, True:
            return Gate.NOT_FOUND_LEFT
        case True, False:
            return Gate.NOT_FOUND_RIGHT
        case _:
            pass
    both = np.isfinite(glance.left_px).all(axis=1) & np.isfinite(glance.right_px).all(axis=1)
    is_enough = (both.sum() >= _LEAST_CORNERS and both.mean() >= _LEAST_SEEN) or bool(both.all())
    if not is_enough:
        return Gate.PART
    apart = np.abs(glance.left_px[both] - glance.right_px[both])
    return Gate.SAME if glance.sizes_px[0] == glance.sizes_px[1] and apart.max() < _SAME_PX else Gate.READY


def speed_widths_s(before: Glance | None, now: Glance) -> float:
    """Return how fast the board moves in the faster of the two images, image widths per second; infinite: it cannot be told.

    An affine motion is fitted to the corners, so that their noise does not count as motion.
    """
    if before is None or not 0 < now.at_ns - before.at_ns <= _STALE_NS:
        return float("inf")
    seconds = (now.at_ns - before.at_ns) / 1e9
    speeds = []
    for old, new, size_px in (
        (before.left_px, now.left_px, now.sizes_px[0]),
        (before.right_px, now.right_px, now.sizes_px[1]),
    ):
        if old.shape != new.shape:
            return float("inf")
        seen = np.isfinite(old).all(axis=1) & np.isfinite(new).all(axis=1)
        if seen.sum() < _LEAST_CORNERS // 2:
            return float("inf")
        plan = np.column_stack([old[seen], np.ones(int(seen.sum()))])
        motion = np.linalg.lstsq(plan, new[seen] - old[seen], rcond=None)[0]
        speeds.append(float(np.linalg.norm(plan @ motion, axis=1).max()) / size_px[0] / seconds)
    return max(speeds)


def is_still(speed: float) -> bool:
    """Return whether a board of this speed, image widths per second, stands still."""
    return speed <= _STILL_WIDTHS_S


def is_paired_well(glance: Glance, speed: float) -> bool:
    """Return whether the board moves little enough between the two exposures."""
    return all(
        speed * width_px * abs(glance.skew_ns) / 1e9 <= _APART_PX * _factor((width_px, height_px))
        for width_px, height_px in glance.sizes_px
    )


def sharp(looks: tuple[BoardLook, BoardLook], sizes_px: tuple[Size, Size], sharpest_px: tuple[float, float]) -> Gate:
    """Return whether a view is sharp and evenly lit, beside the narrowest edges of each camera so far (px; NaN: none yet): READY, or why not."""
    for look, size_px, best_px in zip(looks, sizes_px, sharpest_px, strict=True):
        usual = _BLURRED_FACTOR * best_px if np.isfinite(best_px) else 0.0
        limit_px = min(max(_BLURRED_PX * _factor(size_px), usual), _MOST_BLURRED_PX * _factor(size_px))
        if look.washed > _WASHED:
            return Gate.GLARE
        if look.edge_px > limit_px:
            return Gate.BLURRED
    return Gate.READY


def is_alike(one: Glance, other: Glance) -> bool:
    """Return whether two views show the board in nearly the same place and attitude."""
    for a, b, size_px in zip((one.left_px, one.right_px), (other.left_px, other.right_px), one.sizes_px, strict=True):
        apart, reshaped = _differences(a, b, size_px[0])
        if apart >= _ALIKE or reshaped >= _SAME_SHAPE:
            return False
    return True


def is_far(one: Glance, other: Glance) -> bool:
    """Return whether two views differ so much in place, size or attitude that each teaches what the other does not."""
    apart, reshaped = _differences(one.left_px, other.left_px, one.sizes_px[0][0])
    return apart > _FAR or reshaped > _OTHER_SHAPE


def _differences(one: Corners, other: Corners, width_px: int) -> tuple[float, float]:
    """Return how far apart corners lie on average, and how far once brought together, image widths; infinite: none is common."""
    seen = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    if not seen.any():
        return float("inf"), float("inf")
    moves = one[seen] - other[seen]
    apart = float(np.linalg.norm(moves, axis=1).mean())
    reshaped = float(np.linalg.norm(moves - moves.mean(axis=0), axis=1).mean())
    return apart / width_px, reshaped / width_px


def _factor(size_px: Size) -> float:
    """Return by how much limits in px grow with an image: as those of the verdict do."""
    return max(1.0, max(size_px) / REFERENCE_PX)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A view that was taken.

    Attributes:
        name: how reports name it.
        glance: the board's corners in it.
        looks: how it looks, left and right.
    """

    name: str
    glance: Glance
    looks: tuple[BoardLook, BoardLook]

    @property
    def pair(self) -> BoardPair:
        """Its corners, as the calibration takes them."""
        return BoardPair(self.name, self.glance.left_px, self.glance.right_px)
