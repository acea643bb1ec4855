"""A box in the world, outside of which nothing belongs to the model, and how a grid of cells lies in it, in whole voxels. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Box:
    """A box with its edges along the world's axes.

    Attributes:
        low_m: x, y, z of its lowest corner, m.
        high_m: of the highest, m; each is greater.
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]

    def holds(self, points_m: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return (N,): which of the points (N, 3), m, lie inside."""
        inside = (points_m >= np.array(self.low_m, np.float32)) & (points_m <= np.array(self.high_m, np.float32))
        return np.asarray(inside.all(axis=1), np.bool_)


_MOST_CELLS: Final = 4_000_000
"""A box of 0.3 m has cells of 2 mm: 5 ms of a processor a view."""


@dataclass(frozen=True, slots=True)
class Cells:
    """How a grid lies: cell number n along an axis has the voxels from n * voxels on.

    Attributes:
        low: number of the lowest cell along x, y, z.
        counts: of cells along x, y, z.
        voxels: of a cell's side.
        voxel_m: distance of two voxels, m.
    """

    low: tuple[int, int, int]
    counts: tuple[int, int, int]
    voxels: int
    voxel_m: float

    @property
    def side_m(self) -> float:
        """A cell's side, m."""
        return self.voxels * self.voxel_m

    @property
    def first_m(self) -> NDArray[np.float32]:
        """Middle of the lowest cell, (3,) m."""
        return ((np.array(self.low) * self.voxels + (self.voxels - 1) / 2) * self.voxel_m).astype(np.float32)

    @staticmethod
    def of(box: Box, voxel_m: float) -> "Cells":
        """Choose cells for a box: a voxel wide or, where that would be more than 4 million, some voxels."""
        voxels = 1
        while True:
            low, high = (np.floor(np.array(side) / (voxels * voxel_m)) for side in (box.low_m, box.high_m))
            counts = (high - low + 1).astype(np.int64)
            if counts.prod() <= _MOST_CELLS:
                x, y, z = low.astype(int).tolist()
                wide, deep, tall = counts.tolist()
                return Cells((x, y, z), (wide, deep, tall), voxels, voxel_m)
            voxels += 1
