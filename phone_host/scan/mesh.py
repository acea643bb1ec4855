"""The surface of a volume as triangles with colours: marching cubes over its blocks; its parts, its size, and a smaller one to show. Pure.

A cube is used only where something was seen at all eight corners, so the mesh is open where nobody looked. Blocks are taken in the order of
their places: the same volume gives the same bytes, in whatever order its blocks came.

The 256 cases of a cube whose corners lie on either side of the surface are derived, not listed. On each face the surface is one or two segments between
edges; where a face is ambiguous, its two corners inside are kept apart. Both cubes that share a face decide so, hence the triangles of neighbours fit and the
mesh has no cracks. The segments join to loops, each is a fan.

Source: W. E. Lorensen and H. E. Cline, "Marching Cubes", 1987; the rule for ambiguous faces: C. Montani et al., "A modified look-up table
for implicit disambiguation of Marching Cubes", 1994.
"""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import CORNERS, SIDE, Blocks

EDGES: Final = tuple((low, low | 1 << axis) for axis in range(3) for low in range(8) if not low >> axis & 1)
"""The 12 edges as pairs of corners, the lower first: four along x, four along y, four along z."""

_FACES: Final = ((0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5))
"""Corners around each face, anticlockwise as seen from outside."""


@cache
def cube_cases() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how many triangles each case has, (256,), and the edges on which their corners lie, (256, 5, 3), anticlockwise as seen from outside; unused are -1.

    Bit n of a case's number is set where corner n lies inside.
    """
    lists = [[triangle for loop in _loops(case) for triangle in _fan(loop)] for case in range(256)]
    edges = np.full((256, max(map(len, lists)), 3), -1, np.int64)
    for case, triangles in enumerate(lists):
        edges[case, : len(triangles)] = np.reshape(triangles, (-1, 3))
    return np.array([len(triangles) for triangles in lists]), edges


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


_AT_ONCE: Final = 256
"""Blocks that are taken together: some 10 MB."""

_KEY_BITS: Final = 20
"""Of a voxel's number along each axis: a volume of 1 mm voxels may be 1 km wide."""

_LEAST_SHARE: Final = 0.01
"""Of an edge between a point and its ends: nearer, the points of several edges would be one, and triangles a line."""

_AXIS_OF_EDGE: Final = np.repeat(np.arange(3), 4)


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        points_m: (V, 3) float32, m, in the world.
        colours: (V, 3) uint8, red green blue.
        triangles: (T, 3) int32 numbers of points, anticlockwise as seen from where the camera was.
    """

    points_m: NDArray[np.float32]
    colours: NDArray[np.uint8]
    triangles: NDArray[np.int32]

    @staticmethod
    def empty() -> "Mesh":
        """Return a mesh of nothing."""
        return Mesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8), np.zeros((0, 3), np.int32))


def mesh_of(blocks: Blocks, voxel_m: float, least_weight: int = 1, numbers: NDArray[np.int64] | None = None) -> Mesh:
    """Make the mesh of a volume, or of some of its blocks.

    Args:
        blocks: of the volume.
        voxel_m: distance of two values, m.
        least_weight: of a voxel that counts as seen; more leaves out what was seen only once.
        numbers: of the blocks whose cubes are wanted; None: of all.

    Returns:
        The mesh; without triangles where there is no surface.
    """
    wanted = np.arange(blocks.count) if numbers is None else numbers
    order = wanted[np.lexsort(blocks.places[wanted].T)]
    keys, points, colours, corners = [], [], [], []
    for first in range(0, len(order), _AT_ONCE):
        part = _part(blocks, order[first : first + _AT_ONCE], least_weight)
        keys.append(part.keys)
        points.append(part.points)
        colours.append(part.colours)
        corners.append(part.corners)
    if not keys:
        return Mesh.empty()
    # An edge on the border of two parts was met by both: its point is one.
    whole, chosen = np.unique(np.concatenate(keys), return_index=True)
    triangles = np.searchsorted(whole, np.concatenate(corners)).reshape(-1, 3).astype(np.int32)
    metres = (np.concatenate(points)[chosen] * voxel_m).astype(np.float32)
    return Mesh(metres, np.ascontiguousarray(np.concatenate(colours)[chosen][:, ::-1]), triangles)


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Points on edges: key (P,), place in voxels (P, 3), colour (P, 3); and (T, 3) keys of the triangles' corners."""

    keys: NDArray[np.int64]
    points: NDArray[np.float64]
    colours: NDArray[np.uint8]
    corners: NDArray[np.int64]


def _part(blocks: Blocks, numbers: NDArray[np.int64], least_weight: int) -> _Part:
    """Make the triangles of the cubes whose lowest corner lies in some blocks."""
    field, known, tint = _with_neighbours(blocks, numbers, least_weight)
    size, cases = SIDE + 1, np.zeros((len(numbers), SIDE, SIDE, SIDE), np.int64)
    whole = np.ones(cases.shape, np.bool_)
    for corner, (x, y, z) in enumerate(CORNERS):
        at = np.s_[:, z : z + SIDE, y : y + SIDE, x : x + SIDE]
        cases |= (field[at] < 0).astype(np.int64) << corner
        whole &= known[at]
    counts, edges_of = cube_cases()
    block, z, y, x = np.nonzero(whole & (counts[cases] > 0))
    edges = edges_of[cases[block, z, y, x]]
    used = edges[..., 0] >= 0
    cube = np.broadcast_to(np.arange(len(block))[:, np.newaxis], used.shape)[used]
    edges = edges[used]
    ends = np.array(EDGES)[edges]  # (T, 3, 2) corners
    lower = np.column_stack([x, y, z])[cube][:, np.newaxis, np.newaxis] + CORNERS[ends]
    flat = block[cube][:, np.newaxis, np.newaxis] * size**3 + lower @ np.array([1, size, size**2])
    world = lower[:, :, 0] + SIDE * blocks.places[numbers[block[cube]]].astype(np.int64)[:, np.newaxis]
    keys = _keys(world) * 3 + _AXIS_OF_EDGE[edges]
    distinct, first = np.unique(keys, return_index=True)
    flat, axis = flat.reshape(-1, 2)[first], _AXIS_OF_EDGE[edges].ravel()[first]
    values = field.ravel()[flat].astype(np.float64)
    share = np.clip(values[:, 0] / (values[:, 0] - values[:, 1]), _LEAST_SHARE, 1 - _LEAST_SHARE)
    points = world.reshape(-1, 3)[first].astype(np.float64)
    points[np.arange(len(points)), axis] += share
    shades = tint.reshape(-1, 3)[flat].astype(np.float64)
    colours = shades[:, 0] + (shades[:, 1] - shades[:, 0]) * share[:, np.newaxis]
    return _Part(distinct, points, np.rint(colours).astype(np.uint8), keys)


def _keys(voxels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return one number for each voxel (..., 3)."""
    x, y, z = np.moveaxis(voxels + (1 << _KEY_BITS - 1), -1, 0)
    return np.asarray((((z << _KEY_BITS) + y) << _KEY_BITS) + x, np.int64)


def _with_neighbours(
    blocks: Blocks, numbers: NDArray[np.int64], least_weight: int
) -> tuple[NDArray[np.int16], NDArray[np.bool_], NDArray[np.uint8]]:
    """Return field, what is known, and colours of blocks with one more voxel on each upper side, (N, 9, 9, 9[, 3]) z y x."""
    size, count = SIDE + 1, len(numbers)
    field, known = np.zeros((count, size, size, size), np.int16), np.zeros((count, size, size, size), np.bool_)
    tint = np.zeros((count, size, size, size, 3), np.uint8)
    cube = (-1, SIDE, SIDE, SIDE)
    for step in CORNERS:
        there = blocks.find(blocks.places[numbers] + step.astype(np.int32))
        has, beside = np.flatnonzero(there >= 0), there[there >= 0]
        z, y, x = (slice(SIDE, size) if up else slice(0, SIDE) for up in step[::-1])
        k, j, i = (slice(0, 1) if up else slice(0, SIDE) for up in step[::-1])
        field[has, z, y, x] = blocks.field[beside].reshape(cube)[:, k, j, i]
        known[has, z, y, x] = blocks.weights[beside].reshape(cube)[:, k, j, i] >= least_weight
        tint[has, z, y, x] = blocks.colours[beside].reshape(*cube, 3)[:, k, j, i]
    return field, known, tint


Flags = NDArray[np.bool_]

_CRUMB_SHARE: Final = 0.01
"""Of the largest piece's triangles: smaller pieces are wrong matches that float, or bits of the background."""

_LOOSE_SHARE: Final = 0.05
"""Of the largest body's content: two things in a box both stay."""

_COARSER: Final = 1.15


@dataclass(frozen=True, slots=True)
class MeshSize:
    """How large a mesh is.

    Attributes:
        area_m2: of all triangles, m^2.
        border_m: length of the edges that have a triangle on one side only, m: where the surface ends because nobody saw more; 0 = closed.
        extent_m: its longest sides along the axes, m.
    """

    area_m2: float
    border_m: float
    extent_m: tuple[float, float, float]


NO_SIZE: Final = MeshSize(0.0, 0.0, (0.0, 0.0, 0.0))
"""Of a mesh without triangles."""


def size_of(mesh: Mesh) -> MeshSize:
    """Measure a mesh."""
    if not len(mesh.triangles):
        return NO_SIZE
    points = mesh.points_m.astype(np.float64)
    a, b, c = np.moveaxis(points[mesh.triangles], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    keys, counts = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_counts=True)
    open_ = keys[counts == 1]
    border = np.linalg.norm(points[open_ // len(points)] - points[open_ % len(points)], axis=1).sum()
    x, y, z = np.ptp(points[np.unique(mesh.triangles)], axis=0).tolist()
    return MeshSize(float(area), float(border), (x, y, z))


def only(mesh: Mesh, wanted: Flags) -> Mesh:
    """Return the triangles (T,) that are wanted, and the points they need."""
    return part_of(mesh, wanted)[0]


def part_of(mesh: Mesh, wanted: Flags) -> tuple[Mesh, NDArray[np.int64]]:
    """Return the triangles (T,) that are wanted with the points they need, and the numbers that these points had."""
    used, corners = np.unique(mesh.triangles[wanted], return_inverse=True)
    triangles = corners.reshape(-1, 3).astype(np.int32)
    return Mesh(mesh.points_m[used], mesh.colours[used], triangles), used.astype(np.int64)


def without_crumbs(mesh: Mesh) -> Mesh:
    """Leave out pieces that have less than a hundredth of the largest one's triangles."""
    if not len(mesh.triangles):
        return mesh
    piece = pieces_of(mesh)[mesh.triangles[:, 0]]
    sizes = np.bincount(piece)
    return only(mesh, sizes[piece] >= _CRUMB_SHARE * sizes.max())


def without_loose_bodies(mesh: Mesh) -> Mesh:
    """Leave out bodies of less than a twentieth of the largest one's content, and hollows inside it."""
    if not len(mesh.triangles):
        return mesh
    piece = pieces_of(mesh)[mesh.triangles[:, 0]]
    corners = mesh.points_m.astype(np.float64)[mesh.triangles]
    contents = np.bincount(piece, (np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum(axis=1) / 6)
    return only(mesh, contents[piece] >= _LOOSE_SHARE * contents.max())


def pieces_of(mesh: Mesh) -> NDArray[np.int64]:
    """Return for each point (V,) the lowest point that it hangs together with."""
    lowest = np.arange(len(mesh.points_m))
    while True:
        # Each triangle's corners learn the lowest of the three; then every point jumps to where that one points.
        least = lowest[mesh.triangles].min(axis=1)
        before = lowest.copy()
        for corner in range(3):
            np.minimum.at(lowest, mesh.triangles[:, corner], least)
            np.minimum.at(lowest, before[mesh.triangles[:, corner]], least)
        lowest = lowest[lowest]
        if np.array_equal(lowest, before):
            return lowest


def thinned(mesh: Mesh, most: int, voxel_m: float) -> tuple[Mesh, NDArray[np.int64]]:
    """Make a mesh small enough to be sent or shown, by putting all points of a cell together.

    Args:
        mesh: any.
        most: triangles of the result at most, > 0.
        voxel_m: side of the voxels that it was made of, m.

    Returns:
        The mesh, itself if it is small enough, and for each of its points the number of one that it stands for.
    """
    small, stands_for, cell_m = mesh, np.arange(len(mesh.points_m)), voxel_m
    if len(mesh.triangles) > most:
        cell_m *= np.sqrt(len(mesh.triangles) / most)
    while len(small.triangles) > most:
        small, stands_for = _clustered(mesh, cell_m)
        cell_m *= _COARSER
    return small, stands_for


def _clustered(mesh: Mesh, cell_m: float) -> tuple[Mesh, NDArray[np.int64]]:
    cells = np.floor(mesh.points_m / cell_m).astype(np.int64)
    _, first, cluster, counts = np.unique(cells, axis=0, return_index=True, return_inverse=True, return_counts=True)
    cluster = cluster.reshape(-1)
    points = (
        np.column_stack([np.bincount(cluster, mesh.points_m[:, axis]) for axis in range(3)]) / counts[:, np.newaxis]
    )
    triangles = cluster[mesh.triangles]
    a, b, c = triangles.T
    whole = triangles[(a != b) & (b != c) & (c != a)].astype(np.int32)
    return Mesh(points.astype(np.float32), mesh.colours[first], whole), first
