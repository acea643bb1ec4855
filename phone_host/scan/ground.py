"""The plane that a thing stood on while it turned. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import ONE, SIDE, Blocks
from phone_host.scan.cells import Cells

Floats = NDArray[np.float64]
Numbers = NDArray[np.floating[Any] | np.integer[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """The plane that a thing stands on: nothing of the thing is below it.

    Attributes:
        up: (3,) of length 1.
        point_m: (3,) in the plane.
    """

    up: Floats
    point_m: Floats

    def moved(self, motion: SE3) -> "Ground":
        """Return it where a motion takes it."""
        return Ground(motion.R @ self.up, motion.apply(self.point_m[np.newaxis])[0])

    def heights_m(self, places: tuple[Numbers, Numbers, Numbers], step_m: float) -> NDArray[np.float32]:
        """Return how high places of a grid lie above the plane, (..., Z, Y, X), m.

        Args:
            places: their numbers along x (..., X), y (..., Y) and z (..., Z).
            step_m: from number to number, m.
        """
        x, y, z = ((at * step_m - of) * way for at, of, way in zip(places, self.point_m, self.up, strict=True))
        across = z[..., :, np.newaxis, np.newaxis] + y[..., np.newaxis, :, np.newaxis]
        return np.asarray(across + x[..., np.newaxis, np.newaxis, :], np.float32)

    def below(self, cells: Cells) -> NDArray[np.bool_]:
        """Return which cells (Z, Y, X) have their middle below the plane."""
        x, y, z = (
            (low + np.arange(count) + 0.5) * cells.voxels - 0.5
            for low, count in zip(cells.low, cells.counts, strict=True)
        )
        return self.heights_m((x, y, z), cells.voxel_m) < 0

    def forget_below(self, blocks: Blocks, voxel_m: float) -> None:
        """Forget what a field holds below the plane: what lies behind a thing's foot was never seen.

        Args:
            blocks: whose voxels become unknown.
            voxel_m: distance of two voxels, m.
        """
        first = SIDE * blocks.places[: blocks.count].astype(np.int64)
        x, y, z = (first[:, axis, np.newaxis] + np.arange(SIDE) for axis in range(3))
        heights = self.heights_m((x, y, z), voxel_m)
        low = np.nonzero(heights.reshape(len(first), -1) < 0)
        blocks.field[low], blocks.weights[low], blocks.colours[low] = ONE, 0, 0
