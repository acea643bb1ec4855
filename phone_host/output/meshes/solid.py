"""A mesh on its way between files: points, triangles, colours where there are any. Pure.

Inside, points are metres; files for printers hold millimetres. Triangles go anticlockwise as seen from outside.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """Triangles in space.

    Attributes:
        points_m: (V, 3) float32, m, all finite.
        triangles: (T, 3) int32 numbers of points, 0..V-1.
        colours: (V, 3) uint8, red green blue; (0, 3) where the points have none.
    """

    points_m: NDArray[np.float32]
    triangles: NDArray[np.int32]
    colours: NDArray[np.uint8]

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


def sound_solid(
    name: str, points_m: NDArray[np.float64], triangles: NDArray[np.int64], colours: NDArray[np.uint8]
) -> Solid:
    """Make a mesh of what a file says, if that can be one.

    Args:
        name: of the file, for errors.
        points_m: (V, 3), m.
        triangles: (T, 3) numbers of points.
        colours: (V, 3) or (0, 3) uint8.

    Returns:
        The mesh, without triangles of which two corners are one point.

    Raises:
        DataError: it has no triangle, a corner that is no point, or a point that is no place.
    """
    if not len(triangles):
        raise DataError(f"{name} holds no triangle", "give a mesh, not points alone")
    if triangles.min() < 0 or triangles.max() >= len(points_m):
        raise DataError(f"{name} has a triangle with a corner that is no point of it", "write the file again")
    used = points_m[np.unique(triangles)]
    if not (np.isfinite(used).all() and np.abs(used).max() < _FAR_M):
        raise DataError(
            f"{name} has a corner that is no place (NaN, infinite or beyond 100 km)",
            "mend it in a mesh editor, or scan again",
        )
    a, b, c = triangles.T
    whole = triangles[(a != b) & (b != c) & (c != a)]
    if not len(whole):
        raise DataError(f"{name} holds no triangle with three corners", "give a mesh, not points alone")
    return Solid(points_m.astype(np.float32), np.ascontiguousarray(whole, np.int32), colours)


_FAR_M = 1e5


def welded(solid: Solid) -> Solid:
    """Return a mesh in which points at one place are one, as in files that name each triangle's corners anew (STL).

    Args:
        solid: a mesh.
    """
    places = np.ascontiguousarray(solid.points_m + np.float32(0)).view(np.uint32)  # + 0: minus zero is zero
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    triangles = number.ravel()[solid.triangles].astype(np.int32)
    a, b, c = triangles.T
    kept = triangles[(a != b) & (b != c) & (c != a)]
    return Solid(
        solid.points_m[first], np.ascontiguousarray(kept), solid.colours[first] if solid.has_colours else solid.colours
    )
