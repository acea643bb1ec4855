"""Cuts polygons of any number of corners into triangles. Pure.

A fan from the first corner is right for convex polygons alone: of an L it covers what is no part of it. Where a fan turns back, ears are clipped.
Source: G. H. Meisters, "Polygons Have Ears", American Mathematical Monthly 82 (1975); all polygons of one size are clipped at once here.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Numbers = NDArray[np.integer[Any]]

MAX_CONCAVE: Final = 1024
"""Largest number of corners of a polygon that is not convex: clipping takes the cube of it. A convex one may have any number."""

_MAX_AT_ONCE: Final = 1 << 16
"""Pairs of corners that are compared at once: 0.5 MB for each array, or what one polygon needs."""

_ROWS_AT_ONCE: Final = 1 << 16

_FLAT: Final = 1e-12
"""Share of a polygon's area below which three of its corners count as one line."""


_MAX_WORK: Final = 8_000_000_000
"""Sum of the cubes of the corners of all concave polygons: a minute at the worst, where each round finds one ear."""


class TooManyCornersError(Exception):
    """Raised for a concave polygon of more than `MAX_CONCAVE` corners, or for too many of them. The file's fault."""


@dataclass(slots=True)
class _Work:
    """What clipping may still take."""

    left: int = _MAX_WORK

    def take(self, polygons: int, corners: int) -> None:
        """Take the work of clipping from what is left."""
        self.left -= polygons * corners**3
        if corners > MAX_CONCAVE or self.left < 0:
            raise TooManyCornersError


def triangulate(points: Points, counts: Numbers, corners: Numbers) -> Numbers:
    """Cut polygons into triangles, with no further points; what has fewer than three corners gives none.

    Args:
        points: (V, 3), in any unit.
        counts: (F,) numbers of corners.
        corners: (sum of counts,) numbers of points, 0..V-1, polygon after polygon.

    Returns:
        (T, 3) numbers of points, in the order of the polygons, each with its polygon's way round: `max(count - 2, 0)` for each polygon.

    Raises:
        TooManyCornersError: a concave polygon has too many corners.
    """
    work = _Work()
    if not len(counts):
        return corners.reshape(0, 3)
    if (counts == counts[0]).all():
        return _split_in_chunks(points, corners.reshape(len(counts), -1), work)
    starts = np.cumsum(counts) - counts
    amounts = np.maximum(counts - 2, 0)
    places = np.cumsum(amounts) - amounts
    triangles = np.empty((int(amounts.sum()), 3), corners.dtype)
    for count in np.unique(counts[counts > 2]).tolist():
        rows = np.flatnonzero(counts == count)
        for first in range(0, len(rows), _ROWS_AT_ONCE):
            part = rows[first : first + _ROWS_AT_ONCE, np.newaxis]
            made = _split_in_chunks(points, corners[starts[part] + np.arange(count)], work)
            triangles[places[part] + np.arange(count - 2)] = made.reshape(len(part), count - 2, 3)
    return triangles


def _split_in_chunks(points: Points, polygons: Numbers, work: _Work) -> Numbers:
    """Return (T, 3) for polygons (n, k) of one size, some of them at a time."""
    count = polygons.shape[1]
    if count == 3:
        return polygons
    triangles = np.empty((len(polygons), max(count - 2, 0), 3), polygons.dtype)
    step = max(1, _MAX_AT_ONCE // max(count, 1) ** 2)
    for first in range(0, len(polygons) if count > 3 else 0, step):
        triangles[first : first + step] = _split(points, polygons[first : first + step], work)
    return triangles.reshape(-1, 3)


def _split(points: Points, polygons: Numbers, work: _Work) -> Numbers:
    """Return (n, k - 2, 3) for n polygons of k corners."""
    first = np.broadcast_to(polygons[:, :1], polygons[:, 2:].shape)
    triangles = np.stack([first, polygons[:, 1:-1], polygons[:, 2:]], axis=2)
    corners = points[triangles]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    whole = normals.sum(axis=1)
    # A polygon without area, or with a corner that is no place, is cut anyhow.
    back = np.flatnonzero(((normals @ whole[:, :, np.newaxis])[:, :, 0] <= 0).any(axis=1) & (whole != 0).any(axis=1))
    if len(back):
        work.take(len(back), polygons.shape[1])
        triangles[back] = _clip_ears(_project(points[polygons[back]], whole[back]), polygons[back])
    return triangles


def _project(corners: Points, normals: Points) -> Points:
    """Return (n, k, 2): polygons as seen along the axis that their normals are nearest to, anticlockwise."""
    rows = np.arange(len(corners))
    axis = np.abs(normals).argmax(axis=1)
    u = corners[rows, :, (axis + 1) % 3] * np.sign(normals[rows, axis])[:, np.newaxis]
    return np.stack([u, corners[rows, :, (axis + 2) % 3]], axis=2)


def _clip_ears(flat: Points, polygons: Numbers) -> Numbers:
    """Return (n, k - 2, 3): in each round ears that are no neighbours are cut off, as many of each polygon."""
    made = []
    while polygons.shape[1] > 3:
        before, after = np.roll(polygons, 1, axis=1), np.roll(polygons, -1, axis=1)
        ears = _ears(flat)
        ears &= ~np.roll(ears, 1, axis=1) | (np.cumsum(ears, axis=1) == 1)  # of neighbours the first
        ears[:, -1] &= ~ears[:, 0]
        amount = min(int(ears.sum(axis=1).min()), polygons.shape[1] - 3)
        order = np.argsort(~ears, axis=1, kind="stable")
        cut, left = np.sort(order[:, :amount], axis=1), np.sort(order[:, amount:], axis=1)
        made.append(np.stack([np.take_along_axis(each, cut, axis=1) for each in (before, polygons, after)], axis=2))
        polygons = np.take_along_axis(polygons, left, axis=1)
        flat = np.take_along_axis(flat, left[:, :, np.newaxis], axis=1)
    return np.concatenate([*made, polygons[:, np.newaxis]], axis=1)


def _ears(flat: Points) -> NDArray[np.bool_]:
    """Return (n, k): the corners that can be cut off; where none can, as of a polygon that crosses itself, the one that sticks out most."""
    before, after = np.roll(flat, 1, axis=1), np.roll(flat, -1, axis=1)
    doubled = _cross(flat - before, after - flat)
    limit = _FLAT * np.abs(_cross(flat, after).sum(axis=1, keepdims=True))
    is_convex = doubled > limit
    # Where a convex corner lies in a triangle, one that is not does, too: only those are looked for.
    columns = np.flatnonzero(~is_convex.all(axis=0))
    inside = np.broadcast_to(~is_convex[:, np.newaxis, columns], (*doubled.shape, len(columns))).copy()
    for one, other in ((before, flat), (flat, after), (after, before)):
        edge = other - one
        x, y = (flat[:, np.newaxis, columns, axis] - one[:, :, np.newaxis, axis] for axis in (0, 1))
        inside &= edge[:, :, :1] * y - edge[:, :, 1:] * x >= -limit[:, :, np.newaxis]
        inside &= (x != 0) | (y != 0)  # the triangle's own corners touch it, as does another at the same place
    ears: NDArray[np.bool_] = is_convex & ~inside.any(axis=2)
    none = np.flatnonzero(~ears.any(axis=1))
    ears[none, doubled[none].argmax(axis=1)] = True
    return ears


def _cross(one: Points, other: Points) -> Points:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])
