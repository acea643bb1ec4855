"""The table in a view, and the thing that stands on it. Pure.

The inverse depth of a plane is linear in the pixel, and its noise is the same everywhere, for it is that of the disparity. So planes are found and
fitted in inverse depth. A table is a plane whose upper side is seen, and on which something stands near the middle of the picture: not the floor
below, on which the table stands, too, and no wall.

Source: M. A. Fischler and R. C. Bolles, "Random Sample Consensus", 1981.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import Box
from phone_host.scan.mat import ABOVE_M
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.view import View, narrowed

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WIDTH_PX: Final = 320
_DRAWS: Final = 400
"""Of three pixels that are near each other: where a plane fills a tenth of the view, some of them still lie in it all."""

_NEAR_SHARE: Final = 0.2
"""Of the picture's width: so near each other are the pixels of a draw."""

_JUDGED: Final = 3000
"""Pixels by which draws are compared."""

_SIGMAS: Final = 3.0
_REFINED: Final = 6
_PLANES: Final = 4
_LEAST_SHARE: Final = 0.08
"""Of the pixels with a depth, that lie in a plane: less is the upper side of something."""

_PIECE_SHARE: Final = 0.3
"""Of the pixels of a plane's largest piece, that another piece has."""

_LEAST_UP: Final = 0.15
"""Of a plane's normal along the picture's height: walls have none, and tables are not seen from straight above."""

_MIDDLE_SHARE: Final = 0.5
"""Of the picture's width and height, around its middle: there the thing is."""

_LEAST_PIXELS: Final = 0.002
"""Of the picture, that a thing covers."""

_FOOT_SHARE: Final = 0.45
"""Of a thing's height: it stands on the table if it is seen from as low as that."""

_RIM_SHARE: Final = 0.2
"""Of a thing's width: so far around it the table is not measured."""

_ROOM: Final = 1.5
"""Times the thing's greatest side, as the first view shows it, to either side of its middle: so far it can grow."""

_ROOM_RIM_M: Final = 0.03


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane in the camera's axes: the points p with normal . p = -distance_m.

    Attributes:
        normal: (3,) of length 1, towards the camera.
        distance_m: of the camera from it, m, > 0.
    """

    normal: Floats
    distance_m: float

    def heights_m(self, points_m: Floats) -> Floats:
        """Return how far points (..., 3) lie above it, (...), m."""
        return np.asarray(points_m @ self.normal + self.distance_m, np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A table with a thing on it.

    Attributes:
        plane: the table, in the camera's axes.
        world_camera: where the camera is: the origin lies on the table below the thing's middle, z is up, x goes to the camera's right.
        room: in which the thing is looked for, also in later views; in the axes of the table.
    """

    plane: Plane
    world_camera: SE3
    room: Box


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """The depths of a small view. All are (H, W) or (H, W, 3); `slopes` are x/z, y/z and 1."""

    slopes: Floats
    inverse: Floats  # NaN: no depth
    sigma: float
    points_m: Floats


def find_table(view: View) -> Table | Weakness:
    """Find the highest table on which something stands in the first view; or why there is none."""
    grid = _grid_of(view)
    planes = _planes(grid)
    found = [(plane, thing) for plane in planes if (thing := _thing_on(plane, grid)) is not None]
    if not found:
        return Weakness.BARE_TABLE if planes else Weakness.NO_TABLE
    plane, thing = min(found, key=lambda each: each[0].distance_m)
    for _ in range(_REFINED):
        plane = _beside(plane, thing, grid)
        again = _thing_on(plane, grid)
        thing = thing if again is None else again
    return _table(plane, grid.points_m[thing])


def _grid_of(view: View) -> _Grid:
    depth, geometry, _ = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
    rows, columns = np.indices(depth.shape, np.float64)
    slopes = np.stack(
        [
            (columns - geometry.cx_px) / geometry.focal_px,
            (rows - geometry.cy_px) / geometry.focal_px,
            np.ones(depth.shape),
        ],
        axis=-1,
    )
    known = np.isfinite(depth) & (depth > 0)
    inverse = np.full(depth.shape, np.nan)
    inverse[known] = 1 / depth[known].astype(np.float64)
    return _Grid(
        slopes=slopes,
        inverse=inverse,
        sigma=view.noise_per_m,
        points_m=slopes / inverse[..., np.newaxis],
    )


def _planes(grid: _Grid) -> list[Plane]:
    """Return the planes whose upper side is seen, the one with most pixels first."""
    left: Mask = np.isfinite(grid.inverse)
    least, found = max(_LEAST_SHARE * left.sum(), 50), []
    draw = np.random.default_rng(1)
    for _ in range(_PLANES):
        fit = _drawn(grid, left, draw) if left.sum() >= least else None
        for _ in range(_REFINED):
            if fit is not None:
                inside = _together(left & _in_plane(fit, grid))
                fit = _fitted(grid, inside) if inside.sum() >= least else None
        if fit is None:
            break
        left = left & ~_in_plane(fit, grid)
        plane = _plane_of(fit)
        if -plane.normal[1] >= _LEAST_UP:
            found.append(plane)
    return found


def _drawn(grid: _Grid, left: Mask, draw: np.random.Generator) -> Floats | None:
    """Return the plane (3,) through three pixels in which most others lie: inverse depth = slopes . plane; None: no draw has three pixels."""
    rows, columns = np.nonzero(left)
    height, width = left.shape
    first = draw.integers(len(rows), size=_DRAWS)
    reach = max(int(_NEAR_SHARE * width), 2)
    aside = draw.integers(-reach, reach + 1, size=(_DRAWS, 3, 2))
    aside[:, 0] = 0
    down = np.clip(rows[first, np.newaxis] + aside[..., 0], 0, height - 1)
    across = np.clip(columns[first, np.newaxis] + aside[..., 1], 0, width - 1)
    slopes, inverse = grid.slopes[down, across], grid.inverse[down, across]
    usable = left[down, across].all(axis=1)
    usable[usable] = np.abs(np.linalg.det(slopes[usable])) > 1e-5
    if not usable.any():
        return None
    fits = np.linalg.solve(slopes[usable], inverse[usable][..., np.newaxis])[..., 0]
    judged = np.linspace(0, len(rows) - 1, min(len(rows), _JUDGED)).astype(np.int64)
    off = grid.inverse[rows[judged], columns[judged]] - fits @ grid.slopes[rows[judged], columns[judged]].T
    return np.asarray(fits[np.argmax((np.abs(off) <= _SIGMAS * grid.sigma).sum(axis=1))], np.float64)


def _plane_of(fit: Floats) -> Plane:
    length = float(np.linalg.norm(fit))
    return Plane(-fit / length, 1 / length)


def _in_plane(fit: Floats, grid: _Grid) -> Mask:
    return np.asarray(np.abs(grid.inverse - grid.slopes @ fit) <= _SIGMAS * grid.sigma, np.bool_)


def _together(inside: Mask) -> Mask:
    """Return the pixels of the large pieces: far away much lies in a plane by chance, and there it weighs most."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(inside.astype(np.uint8), connectivity=8)
    if count == 1:
        return inside
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray((areas >= _PIECE_SHARE * areas.max())[labels] & inside, np.bool_)


def _fitted(grid: _Grid, inside: Mask) -> Floats:
    """Fit a plane to pixels by least squares; the noise of their inverse depths is the same."""
    return np.asarray(np.linalg.lstsq(grid.slopes[inside], grid.inverse[inside], rcond=None)[0], np.float64)


def _beside(plane: Plane, thing: Mask, grid: _Grid) -> Plane:
    """Fit a plane again, without what lies below or beside the thing: its own foot is too near to be told from the table."""
    turn = _turn_of(plane)
    aside = grid.points_m @ turn[:2].T
    low, high = np.quantile(aside[thing], [0.01, 0.99], axis=0)
    rim = _RIM_SHARE * (high - low).max()
    fit = -plane.normal / plane.distance_m
    with np.errstate(invalid="ignore"):
        is_free = ((aside < low - rim) | (aside > high + rim)).any(axis=-1)
    inside = _together(_in_plane(fit, grid)) & is_free
    if inside.sum() < _LEAST_PIXELS * thing.size:
        return plane
    return _plane_of(_fitted(grid, inside))


def _thing_on(plane: Plane, grid: _Grid) -> Mask | None:
    """Return the pixels (H, W) of the largest thing that stands on a plane near the middle of the picture; None: there is none."""
    depth = 1 / grid.inverse
    heights = plane.heights_m(grid.points_m)
    # Along the ray a depth errs by sigma z^2; across the plane by the cosine of that.
    across = np.abs(grid.slopes @ plane.normal)
    with np.errstate(invalid="ignore"):
        least_m = np.maximum(ABOVE_M, _SIGMAS * grid.sigma * depth**2 * across)
        is_above = heights > least_m
    above = np.asarray(cv2.morphologyEx(is_above.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(above, connectivity=4)
    height, width = above.shape
    rim_y, rim_x = (int((1 - _MIDDLE_SHARE) / 2 * side) for side in (height, width))
    inner = np.bincount(labels[rim_y : height - rim_y, rim_x : width - rim_x].ravel(), minlength=count)
    inner[0] = 0
    for number in np.argsort(-inner, kind="stable"):
        if inner[number] < _LEAST_PIXELS * above.size:
            return None
        left, _, wide = stats[number, :3]
        thing = labels == number
        low, high = np.quantile(heights[thing], [0.02, 0.98])
        if not (left == 0 and wide == width) and low <= _FOOT_SHARE * high + np.median(least_m[thing]):
            return np.asarray(thing, np.bool_)
    return None


def _turn_of(plane: Plane) -> Floats:
    """Return the rotation (3, 3) from the camera's axes to those of a table."""
    z = plane.normal
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def _table(plane: Plane, thing_m: Floats) -> Table:
    """Return a table with its axes below the middle of a thing's points (N, 3)."""
    turn = _turn_of(plane)
    there = thing_m @ turn.T
    low, high = np.quantile(there, [0.01, 0.99], axis=0)
    x_m, y_m = ((low + high) / 2)[:2].tolist()
    world_camera = SE3(turn, np.array([-x_m, -y_m, plane.distance_m]))
    side_m = float(max(*(high - low)[:2], high[2] + plane.distance_m))
    reach_m = _ROOM * side_m + _ROOM_RIM_M
    return Table(plane, world_camera, Box((-reach_m, -reach_m, ABOVE_M), (reach_m, reach_m, reach_m)))
