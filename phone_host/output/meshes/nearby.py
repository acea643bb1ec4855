"""Which triangles of a mesh lie near which: a grid of cells, each with the triangles that its box meets. Pure."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Indices = NDArray[np.int64]

_CELLS_A_TRIANGLE, _CELLS = 8, 2_000_000
"""On average, and beside that: a floor of two large triangles may meet many cells, a mesh of nothing but long ones gets wider cells."""

_CROWD, _PAIRS_A_TRIANGLE, _PAIRS = 2000, 100, 5_000_000
"""Triangles in one cell, and pairs in one cell on average and beside that. A scan, a relief and what decimation leaves of them have at most 115
in one and 24 to 45 pairs a triangle; a heap in one place has the square of its triangles."""

_BITS: Final = 20
_EPSILON: Final = 1e-9


class Grid:
    """Triangles by place.

    Args:
        corners: (T, 3, 3) the triangles' corners, mm.
    """

    def __init__(self, corners: Points) -> None:
        self.corners = corners
        low, high = corners.min(axis=1), corners.max(axis=1)
        self._origin = low.min(axis=0)
        spans = (high - low).max(axis=1)
        extent = float((high.max(axis=0) - self._origin).max())
        self.cell = max(2 * float(np.median(spans)), extent / (1 << 10), _EPSILON)
        while self._cells(low, high)[2].sum() > _CELLS_A_TRIANGLE * len(corners) + _CELLS:
            self.cell *= 1.5
        first, counts, totals = self._cells(low, high)
        triangle = np.repeat(np.arange(len(corners)), totals)
        place = np.arange(totals.sum()) - np.repeat(np.cumsum(totals) - totals, totals)
        nx, ny, _ = counts[triangle].T
        offset = np.column_stack([place % nx, place // nx % ny, place // (nx * ny)])
        keys = _keys(first[triangle] + offset)
        order = np.argsort(keys, kind="stable")
        self._triangles = triangle[order]
        self._keys, self._starts = np.unique(keys[order], return_index=True)
        self._ends = np.append(self._starts[1:], len(order))

    @property
    def is_crowded(self) -> bool:
        """Whether so many triangles lie in one place that `pairs` and `near` would take hours, and all memory."""
        sizes = self._ends - self._starts
        pairs = int((sizes * (sizes - 1) // 2).sum())
        return int(sizes.max(initial=0)) > _CROWD or pairs > _PAIRS_A_TRIANGLE * len(self.corners) + _PAIRS

    def _cells(self, low: Points, high: Points) -> tuple[Indices, Indices, Indices]:
        """Return each triangle's first cell, its cells along each axis, and their number."""
        first = np.floor((low - self._origin) / self.cell).astype(np.int64)
        counts = np.floor((high - self._origin) / self.cell).astype(np.int64) - first + 1
        return first, counts, np.asarray(counts.prod(axis=1), np.int64)

    def pairs(self) -> Indices:
        """Return (P, 2) triangles whose boxes meet, each pair once, the smaller number first."""
        low, high = self.corners.min(axis=1), self.corners.max(axis=1)
        found = []
        sizes = self._ends - self._starts
        for apart in range(1, int(sizes.max(initial=1))):
            cells = np.flatnonzero(sizes > apart)
            lengths = sizes[cells] - apart
            at = np.repeat(self._starts[cells] - np.cumsum(lengths) + lengths, lengths) + np.arange(lengths.sum())
            one, other = self._triangles[at], self._triangles[at + apart]
            meet = ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
            one, other = one[meet], other[meet]
            found.append(np.minimum(one, other) << 32 | np.maximum(one, other))
        keys = np.sort(np.concatenate(found)) if found else np.zeros(0, np.int64)
        keys = keys[np.append(True, keys[1:] != keys[:-1])[: len(keys)]]
        pairs = np.column_stack([keys >> 32, keys & (1 << 32) - 1])
        return np.asarray(pairs[pairs[:, 0] != pairs[:, 1]], np.int64)

    def near(self, points: Points) -> tuple[Indices, Indices]:
        """Return all (point, triangle) of which the triangle's box meets the point's cell.

        Args:
            points: (N, 3), mm.
        """
        cells = np.floor((points - self._origin) / self.cell).astype(np.int64)
        inside = ((cells >= 0) & (cells < 1 << _BITS)).all(axis=1)
        keys = _keys(np.where(inside[:, np.newaxis], cells, 0))
        at = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        known = inside & (self._keys[at] == keys)
        lengths = np.where(known, self._ends[at] - self._starts[at], 0)
        point = np.repeat(np.arange(len(points)), lengths)
        place = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        return point, self._triangles[np.repeat(self._starts[at], lengths) + place]


def _keys(cells: Indices) -> Indices:
    x, y, z = cells.T
    return np.asarray((z << _BITS | y) << _BITS | x, np.int64)


def hits(begin: Points, way: Points, corners: Points) -> NDArray[np.float64]:
    """Return where lines meet triangles, as shares of their length; NaN where they miss or lie in the triangle's plane.

    Source: Möller, Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.

    Args:
        begin: (N, 3).
        way: (N, 3) from there to the line's end.
        corners: (N, 3, 3).
    """
    first, second, third = (corners[:, corner].T for corner in range(3))
    one, two, along = second - first, third - first, way.T
    across = _cross(along, two)
    determinant = _dot(one, across)
    scale = np.sqrt(_dot(one, one)) * np.sqrt(_dot(two, two)) * np.sqrt(_dot(along, along))
    with np.errstate(all="ignore"):
        from_corner = begin.T - first
        u = _dot(from_corner, across) / determinant
        turned = _cross(from_corner, one)
        v = _dot(along, turned) / determinant
        share = _dot(two, turned) / determinant
        meets = (np.abs(determinant) > _EPSILON * scale) & (u >= 0) & (v >= 0) & (u + v <= 1)
    return np.where(meets, share, np.nan)


def _cross(one: Points, other: Points) -> Points:
    """Return the vector products of (3, N): by columns, which takes a third of the time of np.cross along rows."""
    (a, b, c), (x, y, z) = one, other
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x])


def _dot(one: Points, other: Points) -> NDArray[np.float64]:
    (a, b, c), (x, y, z) = one, other
    return np.asarray(a * x + b * y + c * z, np.float64)
