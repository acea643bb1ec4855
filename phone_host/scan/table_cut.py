"""The table on which a thing turns: found in what stands still, and cut off. Pure."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import StereoGeometry
from phone_host.scan.ground import Ground
from phone_host.scan.turn_axis import TurnAxis
from phone_host.scan.view import Depth, View

Floats = NDArray[np.float64]

_LEAST_UPRIGHT: Final = 0.5
"""Of the axis's length along the picture's height: things that turn about a line of sight stand on nothing."""

_AROUND: Final = 2.0
"""Times the thing's radius: so far around it the table is looked for."""

_LEAST_SHARE: Final = 0.3
"""Of what stands still there, that must lie in one plane across the axis."""

_CUT_VOXELS: Final = 1.5
_BAND_VOXELS: Final = 1.0


def ground_of(axis: TurnAxis, height_m: float, thing_m: Floats) -> Ground | None:
    """Return what a thing stands on; where no table was found, what is as high as its lowest point.

    Args:
        axis: about which it turns.
        height_m: of the table, from `table_height_m`.
        thing_m: (N, 3) points of its surface, m.

    Returns:
        The plane; None: it turns about a line of sight, and nobody knows what is below.
    """
    up = up_of(axis)
    if up is None or not len(thing_m):
        return None
    lowest_m = float(((thing_m - axis.point_m) @ up).min()) if height_m == -np.inf else height_m
    return Ground(up, axis.point_m + lowest_m * up)


def points_of(depth_m: Depth, geometry: StereoGeometry) -> Floats:
    """Return the points (N, 3), m, in the camera's axes, of all pixels with a depth."""
    rows, columns = np.nonzero(np.isfinite(depth_m))
    z = depth_m[rows, columns].astype(np.float64)
    x, y = (columns - geometry.cx_px) / geometry.focal_px * z, (rows - geometry.cy_px) / geometry.focal_px * z
    return np.column_stack([x, y, z])


def up_of(axis: TurnAxis) -> Floats | None:
    """Return the direction of the axis (3,) that points upwards in the picture; None: it points towards the camera or aside."""
    if abs(axis.direction[1]) < _LEAST_UPRIGHT:
        return None
    return axis.direction if axis.direction[1] < 0 else -axis.direction


def table_height_m(still_m: Floats, thing_m: Floats, axis: TurnAxis, voxel_m: float) -> float:
    """Find the table's height.

    Args:
        still_m: (N, 3) points that stand still, m.
        thing_m: (M, 3) points of the thing.
        axis: about which it turns.
        voxel_m: of the model, m.

    Returns:
        Its height along `up_of`, m, from the axis's point; minus infinite where there is none.
    """
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
    """Return a view without the depths of a table and of what lies below it.

    Args:
        view: of the thing.
        axis: about which it turns.
        height_m: of the table, from `table_height_m`.
        voxel_m: of the model, m.
    """
    up = up_of(axis)
    if up is None or height_m == -np.inf:
        return view
    rows, columns = np.nonzero(np.isfinite(view.depth_m))
    heights = (points_of(view.depth_m, view.geometry) - axis.point_m) @ up
    low = heights < height_m + _CUT_VOXELS * voxel_m
    depth = view.depth_m.copy()
    depth[rows[low], columns[low]] = np.nan
    return replace(view, depth_m=depth)
