"""A mesh on its way between files: points, triangles, colours where there are any. Pure.

Inside, points are metres; files for printers hold millimetres. Triangles go anticlockwise as seen from outside.
"""

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.meshes.polygons import MAX_CONCAVE, TooManyCornersError, triangulate

NO_FLAGS: Final[NDArray[np.bool_]] = np.zeros(0, np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """Triangles in space.

    Attributes:
        points_m: (V, 3) float32, m, all finite.
        triangles: (T, 3) int32 numbers of points, 0..V-1.
        colours: (V, 3) uint8, red green blue; (0, 3) where the points have none.
        seen: (V,) whether some view of a scan measured each point; (0,) where nothing says so.
    """

    points_m: NDArray[np.float32]
    triangles: NDArray[np.int32]
    colours: NDArray[np.uint8]
    seen: NDArray[np.bool_] = field(default_factory=lambda: NO_FLAGS)

    @property
    def has_colours(self) -> bool:
        """Whether its points have colours."""
        return len(self.colours) > 0

    @property
    def points_mm(self) -> NDArray[np.float32]:
        """(V, 3) float32, mm."""
        return (self.points_m.astype(np.float64) * 1000).astype(np.float32)

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Its extent along x, y and z, mm."""
        x, y, z = (self.points_m[self.triangles.ravel()].astype(np.float64) * 1000).T
        return float(np.ptp(x)), float(np.ptp(y)), float(np.ptp(z))

    def face_colours(self) -> NDArray[np.uint8]:
        """Return (T, 3) uint8: the mean of each triangle's corners; (0, 3) where the points have no colours."""
        if not self.has_colours:
            return np.zeros((0, 3), np.uint8)
        return np.asarray(np.rint(self.colours[self.triangles].mean(axis=1)), np.uint8)


NO_COLOURS: Final = np.zeros((0, 3), np.uint8)
_MAX_M: Final = 1e5
"""Farthest place that a corner may have: 100 km."""

_FEW: Final = 16
"""Points for each corner from which on sorting the corners is faster than a walk along all points."""


def sound_solid(
    name: str,
    points_m: NDArray[np.float64],
    triangles: NDArray[np.integer[Any]],
    colours: NDArray[np.uint8] = NO_COLOURS,
    seen: NDArray[np.bool_] = NO_FLAGS,
) -> Solid:
    """Make a mesh of what a file says, if that can be one.

    Args:
        name: of the file, for errors.
        points_m: (V, 3), m.
        triangles: (T, 3) numbers of points.
        colours: (V, 3) or (0, 3).
        seen: (V,) or (0,).

    Returns:
        The mesh, without triangles of which two corners are one point, and without points that no triangle uses: those may be NaN.

    Raises:
        DataError: it has no triangle, a corner that is no point, or a point that is no place.
    """
    if not len(triangles):
        raise DataError(f"{name} holds no triangle", "give a mesh, not points alone")
    require_corners(name, triangles, len(points_m))
    whole = np.ascontiguousarray(triangles, np.int32)
    used, whole = used_points(whole, len(points_m))
    points_m, colours, seen = (
        points_m[used],
        colours[used] if len(colours) else colours,
        seen[used] if len(seen) else seen,
    )
    if not (points_m.min() > -_MAX_M and points_m.max() < _MAX_M):  # neither holds of NaN
        raise DataError(
            f"{name} has a corner that is no place (NaN, infinite or beyond 100 km)",
            "mend it in a mesh editor, or scan again",
        )
    return Solid(points_m.astype(np.float32), require_triangles(name, whole), colours, seen)


def used_points(triangles: NDArray[Any], count: int) -> tuple[NDArray[np.integer[Any]] | slice, NDArray[np.int32]]:
    """Find the points that triangles use, in time that does not grow with the points that they do not use.

    Args:
        triangles: (T, 3) numbers of points, 0..count-1.
        count: how many points there are.
    """
    if _FEW * triangles.size < count:
        few, numbers = np.unique(triangles, return_inverse=True)
        return few, numbers.reshape(triangles.shape).astype(np.int32)
    is_used = np.zeros(count, np.bool_)
    is_used[triangles] = True
    if is_used.all():
        return slice(None), triangles.astype(np.int32, copy=False)
    return np.flatnonzero(is_used), (np.cumsum(is_used, dtype=np.int32) - 1)[triangles]


def require_corners(name: str, corners: NDArray[np.integer[Any]], count: int) -> None:
    """Check that corners are points.

    Raises:
        DataError: one of them is none.
    """
    if corners.size and not 0 <= corners.min() <= corners.max() < count:
        raise DataError(f"{name} has a triangle with a corner that is no point of it", "write the file again")


def polygon_triangles(
    name: str, points: NDArray[np.float64], counts: NDArray[np.integer[Any]], corners: NDArray[np.integer[Any]]
) -> NDArray[np.integer[Any]]:
    """Return the triangles of a file's polygons.

    Args:
        name: of the file, for errors.
        points: (V, 3).
        counts: (F,) numbers of corners.
        corners: numbers of points, polygon after polygon.

    Raises:
        DataError: a corner is no point, or a polygon has too many corners.
    """
    require_corners(name, corners, len(points))
    try:
        return triangulate(points, counts, corners)
    except TooManyCornersError:
        raise DataError(
            f"{name} has concave faces of too many corners (more than {MAX_CONCAVE}, or too many such faces)",
            "let the program that made it write triangles",
        ) from None


def require_triangles(name: str, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Leave out triangles of which two corners are one point.

    Args:
        name: of the file, for errors.
        triangles: (T, 3).

    Raises:
        DataError: none is left.
    """
    a, b, c = triangles.T
    is_whole = (a != b) & (b != c) & (c != a)
    if not is_whole.any():
        raise DataError(f"{name} holds no triangle with three corners", "give a mesh, not points alone")
    return triangles if is_whole.all() else triangles[is_whole]


def colours_of_points(corners: NDArray[np.integer[Any]], colours: NDArray[np.uint8], count: int) -> NDArray[np.uint8]:
    """Return (V, 3): for each point the mean of the colours that its corners have; black where it is no corner.

    Args:
        corners: (N,) numbers of points, 0..V-1.
        colours: (N, 3) of the corners.
        count: V.
    """
    amounts = np.maximum(np.bincount(corners, minlength=count), 1)
    sums = [np.bincount(corners, colours[:, channel], count) for channel in range(3)]
    return np.asarray(np.rint(np.stack(sums, axis=1) / amounts[:, np.newaxis]), np.uint8)


def welded(solid: Solid) -> Solid:
    """Return a mesh in which points at one place are one, as in files that name each triangle's corners anew (STL)."""
    places = np.ascontiguousarray(solid.points_m + np.float32(0)).view(np.uint32)  # + 0: minus zero is zero
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    triangles = number.ravel()[solid.triangles].astype(np.int32)
    a, b, c = triangles.T
    is_whole = (a != b) & (b != c) & (c != a)
    return Solid(
        solid.points_m[first], triangles[is_whole], solid.colours[first] if solid.has_colours else solid.colours
    )


def weld_seams(solid: Solid) -> Solid:
    """Return a mesh without seams: many programs part its points where texture or normals change, which leaves edges open.

    Args:
        solid: a mesh; one without open edges stays as it is.
    """
    return welded(solid) if _has_open_edges(solid) else solid


def _has_open_edges(solid: Solid) -> bool:
    """Return whether an edge belongs to one triangle alone."""
    edges = np.empty((3, len(solid.triangles)), np.int64)
    for row, corner in zip(edges, range(3), strict=True):
        one, other = solid.triangles[:, corner], solid.triangles[:, (corner + 1) % 3]
        np.minimum(one, other, out=row)
        np.multiply(row, len(solid.points_m), out=row)
        np.add(row, np.maximum(one, other), out=row)
    sorted_edges = edges.reshape(-1)
    sorted_edges.sort()
    is_new = np.ones(sorted_edges.size + 1, np.bool_)
    np.not_equal(sorted_edges[1:], sorted_edges[:-1], out=is_new[1:-1])
    return bool((is_new[1:] & is_new[:-1]).any())
