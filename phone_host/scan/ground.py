"""The plane that a thing stood on while it turned: found in what stands still, and cut off. Pure."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import ONE, SIDE, Blocks, Cells
from phone_host.scan.circle_bundle import TurnAxis
from phone_host.scan.view import View, points_of

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
        """Return how high places of a grid of steps, m, lie above the plane, (..., Z, Y, X), m, by their numbers along x (..., X), y (..., Y) and z (..., Z)."""
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
        """Forget what a field holds below the plane: what lies behind a thing's foot was never seen."""
        first = SIDE * blocks.places[: blocks.count].astype(np.int64)
        x, y, z = (first[:, axis, np.newaxis] + np.arange(SIDE) for axis in range(3))
        heights = self.heights_m((x, y, z), voxel_m)
        low = np.nonzero(heights.reshape(len(first), -1) < 0)
        blocks.field[low], blocks.weights[low], blocks.colours[low] = ONE, 0, 0


_LEAST_UPRIGHT: Final = 0.5
"""Of the axis's length along the picture's height: things that turn about a line of sight stand on nothing."""

_AROUND: Final = 2.0
"""Times the thing's radius: so far around it the table is looked for."""

_LEAST_SHARE: Final = 0.3
"""Of what stands still there, that must lie in one plane across the axis."""

_CUT_VOXELS: Final = 1.5
_BAND_VOXELS: Final = 1.0


def ground_of(axis: TurnAxis, height_m: float, thing_m: Floats) -> Ground | None:
    """Return what a thing of points (N, 3), m, stands on; where no table was found, what is as high as its lowest point; None: it turns about a line of sight."""
    up = up_of(axis)
    if up is None or not len(thing_m):
        return None
    lowest_m = float(((thing_m - axis.point_m) @ up).min()) if height_m == -np.inf else height_m
    return Ground(up, axis.point_m + lowest_m * up)


def up_of(axis: TurnAxis) -> Floats | None:
    """Return the direction of the axis (3,) that points upwards in the picture; None: it points towards the camera or aside."""
    if abs(axis.direction[1]) < _LEAST_UPRIGHT:
        return None
    return axis.direction if axis.direction[1] < 0 else -axis.direction


def table_height_m(still_m: Floats, thing_m: Floats, axis: TurnAxis, voxel_m: float) -> float:
    """Return the table's height along `up_of`, m, from the axis's point, by points that stand still (N, 3) and those of the thing (M, 3), m; minus infinite: there is none."""
    up = up_of(axis)
    if up is None or not len(thing_m):
        return -np.inf
    own, there = still_m - axis.point_m, thing_m - axis.point_m
    heights = own @ up
    radius = float(np.quantile(np.linalg.norm(there - (there @ up)[:, np.newaxis] * up, axis=1), 0.95))
    near = np.linalg.norm(own - heights[:, np.newaxis] * up, axis=1) <= _AROUND * radius
    heights = np.sort(heights[near & (heights < np.median(there @ up))])
    if len(heights) < 50:
        return -np.inf
    band = 2 * _BAND_VOXELS * voxel_m
    ends = np.searchsorted(heights, heights + band, side="right")
    most = int(np.argmax(ends - np.arange(len(heights))))
    if ends[most] - most < _LEAST_SHARE * len(heights):
        return -np.inf
    return float(np.median(heights[most : ends[most]]))


def above(view: View, axis: TurnAxis, height_m: float, voxel_m: float) -> View:
    """Return a view without the depths of a table and of what lies below it."""
    up = up_of(axis)
    if up is None or height_m == -np.inf:
        return view
    rows, columns = np.nonzero(np.isfinite(view.depth_m))
    heights = (points_of(view.depth_m, view.geometry) - axis.point_m) @ up
    low = heights < height_m + _CUT_VOXELS * voxel_m
    depth = view.depth_m.copy()
    depth[rows[low], columns[low]] = np.nan
    return replace(view, depth_m=depth)
