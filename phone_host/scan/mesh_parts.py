"""Parts of a mesh, its size, and a smaller one to show. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.mesh import Mesh

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
