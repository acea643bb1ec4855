"""What the views that were taken cover: places in each image, distances, tilts. Pure."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from phone_host.calibration.guide.gates import Size
from phone_host.calibration.guide.placement import Placement
from phone_host.calibration.target.corners import Corners

COLUMNS, ROWS = 8, 6
"""Cells of an image: as fine as lenses bend."""


class Depth(Enum):
    """How far the board is, by the share of the width that it fills, up to which."""

    FAR = 0.25
    MIDDLE = 0.42
    NEAR = float("inf")


class Tilt(Enum):
    """Which edge of the board is away."""

    FLAT = "flat"
    LEFT_AWAY = "left away"
    RIGHT_AWAY = "right away"
    TOP_AWAY = "top away"
    BOTTOM_AWAY = "bottom away"


_FLAT_DEG: Final = 12.0


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the views taken so far cover of one camera.

    Attributes:
        size_px: of its images.
        cells: corners seen in each cell, row by row.
        depths: views at each depth, in the order of `Depth`.
        tilts: views at each tilt, in the order of `Tilt`.
    """

    size_px: Size
    cells: tuple[tuple[int, ...], ...] = ((0,) * COLUMNS,) * ROWS
    depths: tuple[int, ...] = (0,) * len(Depth)
    tilts: tuple[int, ...] = (0,) * len(Tilt)

    @property
    def share(self) -> float:
        """Share of the cells in which corners were seen."""
        return sum(count > 0 for row in self.cells for count in row) / (COLUMNS * ROWS)

    def with_view(self, corners: Corners, placement: Placement) -> "Coverage":
        """Return what is covered with one view more.

        Args:
            corners: (N, 2) px; NaN: not seen.
            placement: of the board in it.
        """
        seen = corners[np.isfinite(corners).all(axis=1)]
        counts, _, _ = np.histogram2d(
            seen[:, 1], seen[:, 0], bins=(ROWS, COLUMNS), range=((0, self.size_px[1]), (0, self.size_px[0]))
        )
        cells = np.array(self.cells) + counts.astype(int)
        return Coverage(
            size_px=self.size_px,
            cells=tuple(tuple(int(count) for count in row) for row in cells),
            depths=_counted(self.depths, list(Depth).index(depth_of(placement))),
            tilts=_counted(self.tilts, list(Tilt).index(tilt_of(placement))),
        )


def depth_of(placement: Placement) -> Depth:
    """Return how far a board is."""
    return next(depth for depth in Depth if placement.fills <= depth.value)


def tilt_of(placement: Placement) -> Tilt:
    """Return how a board is tilted: the way in which it is tilted most."""
    across, down = placement.tilt_deg
    if max(abs(across), abs(down)) < _FLAT_DEG:
        return Tilt.FLAT
    if abs(across) >= abs(down):
        return Tilt.LEFT_AWAY if across > 0 else Tilt.RIGHT_AWAY
    return Tilt.TOP_AWAY if down > 0 else Tilt.BOTTOM_AWAY


def _counted(counts: tuple[int, ...], at: int) -> tuple[int, ...]:
    return tuple(count + (index == at) for index, count in enumerate(counts))
