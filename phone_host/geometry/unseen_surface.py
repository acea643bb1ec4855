"""The part of a closed surface that no view measured: its share, its colours, and the surface without it. Pure.

A surface is points, triangles and a flag for each point: whether a view measured it.
"""

from typing import Final, assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.model import UnseenSurface

Flags = NDArray[np.bool_]
Colours = NDArray[np.uint8]
Triangles = NDArray[np.int32]
Floats = NDArray[np.float32]

PINK_RGB: Final = (214, 74, 214)
"""Colour that marks unseen surface: few objects are pink all over."""

_GREY: Final = 128.0
"""Colour of a surface of which no view measured anything."""

_RELAXATIONS: Final = 40
"""Passes in which each unseen point takes the mean of its neighbours. They blur the streaks that the flood leaves; after 20 these can still be seen."""


def unseen_share(points_m: NDArray[np.float32], triangles: Triangles, seen: Flags) -> float:
    """Return the share of the area that no view measured, 0..1; NaN without an area.

    Args:
        points_m: (V, 3), m.
        triangles: (T, 3) numbers of points.
        seen: (V,) whether a view measured each point; a triangle counts by its corners.
    """
    a, b, c = np.moveaxis(points_m.astype(np.float64)[triangles], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    unseen = (~seen[triangles]).mean(axis=1)
    return float((unseen * areas).sum() / areas.sum()) if areas.sum() > 0 else float("nan")


def apply_unseen(colours: Colours, triangles: Triangles, seen: Flags, choice: UnseenSurface) -> tuple[Colours, Flags]:
    """Fill, paint or cut the surface that no view measured.

    Args:
        colours: (V, 3), red green blue; (0, 3) where the points have none.
        triangles: (T, 3) numbers of points.
        seen: (V,) whether a view measured each point.
        choice: what becomes of that surface.

    Returns:
        The colours of all points, shaped as before, and which triangles remain, (T,).
    """
    whole = np.ones(len(triangles), np.bool_)
    match choice:
        case UnseenSurface.CUT:
            return colours, seen_triangles(triangles, seen)
        case UnseenSurface.FILL | UnseenSurface.PINK if not len(colours):
            return colours, whole
        case UnseenSurface.FILL:
            return filled_from_border(colours, triangles, seen), whole
        case UnseenSurface.PINK:
            return np.where(seen[:, np.newaxis], colours, np.array(PINK_RGB, np.uint8)), whole
    assert_never(choice)


def seen_triangles(triangles: Triangles, seen: Flags) -> Flags:
    """Return which triangles remain when unseen surface is cut, (T,): those of which a view measured all corners.

    Args:
        triangles: (T, 3) numbers of points.
        seen: (V,) whether a view measured each point.
    """
    return np.asarray(seen[triangles].all(axis=1), np.bool_)


def filled_from_border(colours: Colours, triangles: Triangles, seen: Flags) -> Colours:
    """Return the colours with unseen points coloured from the border of the seen surface, (V, 3).

    A flood along the edges gives each unseen point the mean of its neighbours that have a colour already. Then some passes relax the
    colours towards the harmonic function with these values on the border (Laplace's equation on the graph of the edges). A part that has
    no border takes the mean of all seen points. The colours that unseen points had before do not matter, so a second call changes nothing.

    Args:
        colours: (V, 3), red green blue.
        triangles: (T, 3) numbers of points.
        seen: (V,) whether a view measured each point.
    """
    if seen.all():
        return colours
    mean = colours[seen].mean(axis=0, dtype=np.float64) if seen.any() else _GREY
    shades = np.where(seen[:, np.newaxis], colours, np.float32(0)).astype(np.float32)
    ends, begins = _edges_into(triangles, ~seen)
    shades[~_flood(shades, ends, begins, seen)] = mean
    _relax(shades, ends, begins)
    return np.where(seen[:, np.newaxis], colours, np.rint(shades).astype(np.uint8))


def _edges_into(triangles: Triangles, wanted: Flags) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return both ends of each edge that leads to a wanted point, (E,) and (E,), sorted by the ends; each edge once in each direction."""
    corners = triangles[wanted[triangles].any(axis=1)].astype(np.int64)
    ends = corners[:, [0, 1, 1, 2, 2, 0]].ravel()
    begins = corners[:, [1, 0, 2, 1, 0, 2]].ravel()
    leads, count = wanted[ends], len(wanted)
    keys = np.unique(ends[leads] * count + begins[leads])
    return keys // count, keys % count


def _flood(shades: Floats, ends: NDArray[np.int64], begins: NDArray[np.int64], seen: Flags) -> Flags:
    """Colour what hangs together with seen points, in place, ring by ring; return which points have a colour, (V,)."""
    has_colour = seen.copy()
    order = np.argsort(begins, kind="stable")
    targets = ends[order]
    firsts = np.searchsorted(begins[order], np.arange(len(seen) + 1))
    front = np.unique(begins[seen[begins]])
    while len(front):
        counts = firsts[front + 1] - firsts[front]
        at = np.repeat(firsts[front] - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
        reached, sources = targets[at], np.repeat(front, counts)
        is_new = ~has_colour[reached]
        front, numbers = np.unique(reached[is_new], return_inverse=True)
        amounts = np.bincount(numbers, minlength=len(front))
        for channel in range(3):
            shades[front, channel] = np.bincount(numbers, shades[sources[is_new], channel], len(front)) / amounts
        has_colour[front] = True
    return has_colour


def _relax(shades: Floats, ends: NDArray[np.int64], begins: NDArray[np.int64]) -> None:
    """Let each point to which edges lead take the mean of its neighbours, some times, in place."""
    if not len(ends):
        return
    points, firsts, counts = np.unique(ends, return_index=True, return_counts=True)
    share = np.float32(1) / counts.astype(np.float32)
    for _ in range(_RELAXATIONS):
        shades[points] = np.add.reduceat(shades[begins], firsts, axis=0) * share[:, np.newaxis]
