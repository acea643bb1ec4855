"""Fewer triangles for the same shape, by manifold3d: a library of the extra `print`. Pure.

It takes closed meshes only, and keeps them closed. Where triangles move they may cross others, so that is looked for; where it happens, the
surface may move less.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from phone_host.output.meshes.nearby import Grid
from phone_host.output.meshes.printable import crossing
from phone_host.output.meshes.solid import Solid, welded

if TYPE_CHECKING:
    import manifold3d

_TRIED: Final = (1.0, 0.3, 0.1)
"""Shares of the tolerance, until no triangle crosses another."""


class NoLibraryError(Exception):
    """Raised where manifold3d is not installed. Nobody's fault: Termux has none."""


@dataclass(frozen=True, slots=True, eq=False)
class Decimated:
    """What came of it.

    Attributes:
        solid: the mesh, with fewer triangles where it is closed.
        is_closed: whether it is closed, every edge between two triangles; an open mesh stays as it is.
    """

    solid: Solid
    is_closed: bool


def decimated(solid: Solid, tolerance_m: float) -> Decimated:
    """Leave out triangles that say nothing.

    Args:
        solid: the mesh.
        tolerance_m: the new surface stays as near as this to the old one, m.

    Raises:
        NoLibraryError: manifold3d is not installed.
    """
    try:
        import manifold3d  # noqa: PLC0415 - an extra, that phones do not have
    except ImportError:
        raise NoLibraryError from None
    properties = solid.points_mm
    if solid.has_colours:
        properties = np.hstack([solid.points_mm, solid.colours.astype(np.float32)])
    mesh = manifold3d.Mesh(np.ascontiguousarray(properties, np.float32), solid.triangles.astype(np.uint32))
    shape = manifold3d.Manifold(mesh)
    if shape.status() != manifold3d.Error.NoError or shape.is_empty():
        return Decimated(solid, is_closed=False)
    for share in _TRIED:
        fewer = _solid(shape.simplify(1000 * tolerance_m * share).to_mesh(), has_colours=solid.has_colours)
        if len(fewer.triangles) and not _crosses(fewer):
            return Decimated(fewer, is_closed=True)
    return Decimated(solid, is_closed=True)


def _crosses(solid: Solid) -> bool:
    corners = solid.points_mm[solid.triangles].astype(np.float64)
    grid = Grid(corners)
    return grid.is_crowded or bool(crossing(grid, solid.triangles).any())


def _solid(mesh: "manifold3d.Mesh", *, has_colours: bool) -> Solid:
    """Return a library's mesh as ours. Points that it holds twice, with two colours, become one."""
    points = np.asarray(mesh.vert_properties)
    colours = np.rint(np.clip(points[:, 3:6], 0, 255)).astype(np.uint8) if has_colours else np.zeros((0, 3), np.uint8)
    return welded(Solid((points[:, :3] / 1000).astype(np.float32), np.asarray(mesh.tri_verts, np.int32), colours))
