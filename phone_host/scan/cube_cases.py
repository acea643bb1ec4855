"""The triangles of a cube whose corners lie on either side of a surface: the 256 cases of marching cubes, derived, not listed. Pure.

On each face of the cube the surface is one or two segments between edges; where a face is ambiguous, its two corners inside are kept apart. Both
cubes that share a face decide so, hence the triangles of neighbours fit and the mesh has no cracks. The segments join to loops, each is a fan.

Source: W. E. Lorensen and H. E. Cline, "Marching Cubes", 1987; the rule for ambiguous faces: C. Montani et al., "A modified look-up table
for implicit disambiguation of Marching Cubes", 1994.
"""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

CORNERS: Final = np.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)])
"""(8, 3) of the cube: corner n lies at x = bit 0, y = bit 1, z = bit 2 of n."""

EDGES: Final = tuple((low, low | 1 << axis) for axis in range(3) for low in range(8) if not low >> axis & 1)
"""The 12 edges as pairs of corners, the lower first: four along x, four along y, four along z."""

_FACES: Final = ((0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5))
"""Corners around each face, anticlockwise as seen from outside."""


@dataclass(frozen=True, slots=True, eq=False)
class CubeCases:
    """The triangles of all cases.

    Attributes:
        counts: (256,) triangles of each case; bit n of a case's number is set where corner n lies inside.
        edges: (256, 5, 3) the edges on which their corners lie, anticlockwise as seen from outside the surface; unused are -1.
    """

    counts: NDArray[np.int64]
    edges: NDArray[np.int64]


@cache
def cube_cases() -> CubeCases:
    """Return the triangles of all cases."""
    lists = [[triangle for loop in _loops(case) for triangle in _fan(loop)] for case in range(256)]
    edges = np.full((256, max(map(len, lists)), 3), -1, np.int64)
    for case, triangles in enumerate(lists):
        edges[case, : len(triangles)] = np.reshape(triangles, (-1, 3))
    return CubeCases(np.array([len(triangles) for triangles in lists]), edges)


def _edge(one: int, other: int) -> int:
    return EDGES.index((min(one, other), max(one, other)))


def _segments(case: int) -> dict[int, int]:
    """Return the edge to which the surface goes on from each edge that it crosses, around what lies inside."""
    onward = {}
    for face in _FACES:
        inside = [bool(case >> corner & 1) for corner in face]
        for at in range(4):
            if (
                inside[at] and not inside[at - 1]
            ):  # the surface enters before this corner, and leaves after the last one inside
                last = at
                while inside[(last + 1) % 4]:
                    last += 1
                leaves, enters = _edge(face[last % 4], face[(last + 1) % 4]), _edge(face[at - 1], face[at])
                onward[enters] = leaves
    return onward


def _loops(case: int) -> list[list[int]]:
    onward, loops = _segments(case), []
    while onward:
        first, at = next(iter(onward.items()))
        loop = [first]
        del onward[first]
        while at != first:
            loop.append(at)
            at = onward.pop(at)
        loops.append(loop)
    return loops


def _fan(loop: list[int]) -> list[tuple[int, int, int]]:
    """Return triangles from one point of a loop to the others, from one such that no triangle's new side lies in a face of the cube.

    The neighbour might have the same side there: four triangles at one edge, or two in one plane.
    """
    turned = (loop[first:] + loop[:first] for first in range(len(loop)))
    best = next(each for each in turned if not any(_share_a_face(each[0], other) for other in each[2:-1]))
    return [(best[0], best[at + 1], best[at]) for at in range(1, len(best) - 1)]


def _share_a_face(one: int, other: int) -> bool:
    return any(set(EDGES[one]) | set(EDGES[other]) <= set(face) for face in _FACES)
