"""What manifold3d, a library of the extra `print`, does to a mesh: fewer triangles for the same shape; and mends what needs no invention. Pure.

It takes closed meshes only, and keeps them closed. Where triangles move they may cross others, so that is looked for; where it happens, the
surface may move less.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from common.words import counted
from phone_host.output.meshes.nearby import Grid
from phone_host.output.meshes.printable import Points, Printer, Triangles, bodies, crossing, fit_of, volume_mm3
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


_BASE_SHARE: Final = 0.1
"""Of the area under the thing that the cut base shall have."""

_MOST_CUT: Final = 0.1
"""Share of the height that may be cut off for it."""

_CUTS: Final = 20
_MARGIN: Final = 0.98


class NotClosedError(Exception):
    """Raised for a mesh that is not closed: nobody can say what is inside. The scan's fault."""


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """What came of it.

    Attributes:
        points_mm: (V, 3) float64, on the bed: z from 0.
        triangles: (T, 3) int32.
        said: what was done, one sentence each; none: there was nothing to do.
    """

    points_mm: Points
    triangles: Triangles
    said: tuple[str, ...]


def fixed(points_mm: Points, triangles: Triangles, printer: Printer, *, needs_base: bool) -> Fixed:
    """Mend a mesh.

    Args:
        points_mm: (V, 3), z up.
        triangles: (T, 3).
        printer: what it shall be printed by.
        needs_base: whether a flat base shall be cut.

    Raises:
        NoLibraryError: manifold3d is not installed.
        NotClosedError: the mesh is not closed, even without its crumbs.
    """
    said = []
    body = bodies(len(points_mm), triangles)
    sizes = np.bincount(body)
    if len(sizes) > 1:
        triangles = triangles[body == sizes.argmax()]
        said.append(f"dropped {counted(len(sizes) - 1, 'body', 'bodies')} beside the largest")
    if volume_mm3(points_mm[triangles]) < 0:
        triangles = triangles[:, ::-1]
        said.append("turned the triangles outwards")
    shape = _manifold(points_mm, triangles)
    if needs_base:
        shape, cut_mm = _based(shape)
        said.append(f"cut {cut_mm:.1f} mm off below, for a flat base")
    x0, y0, z0, x1, y1, z1 = shape.bounding_box()
    fit = fit_of(np.array([x1 - x0, y1 - y0, z1 - z0]), printer.bed_mm)
    if fit < 1:
        shape = shape.scale([_MARGIN * fit] * 3)
        said.append(f"scaled it to {_MARGIN * fit:.1%}, which fits the bed")
    mesh = shape.to_mesh()
    points = np.asarray(mesh.vert_properties, np.float64)[:, :3]
    return Fixed(points - [0, 0, points[:, 2].min()], np.asarray(mesh.tri_verts, np.int32), tuple(said))


def _manifold(points_mm: Points, triangles: Triangles) -> "manifold3d.Manifold":
    try:
        import manifold3d  # noqa: PLC0415 - an extra, that phones do not have
    except ImportError:
        raise NoLibraryError from None
    used, numbers = np.unique(triangles, return_inverse=True)
    mesh = manifold3d.Mesh(points_mm[used].astype(np.float32), numbers.reshape(-1, 3).astype(np.uint32))
    shape = manifold3d.Manifold(mesh)
    if shape.status() != manifold3d.Error.NoError or shape.is_empty():
        raise NotClosedError
    return shape


def _based(shape: "manifold3d.Manifold") -> "tuple[manifold3d.Manifold, float]":
    """Cut as little off below as gives a base to stand on."""
    x0, y0, z0, x1, y1, z1 = shape.bounding_box()
    wanted_mm2 = _BASE_SHARE * (x1 - x0) * (y1 - y0)
    steps_mm = np.linspace(0, _MOST_CUT * (z1 - z0), _CUTS + 1)[1:]
    areas_mm2 = [shape.slice(z0 + step_mm).area() for step_mm in steps_mm]
    enough = np.flatnonzero(np.array(areas_mm2) >= wanted_mm2)
    cut_mm = float(steps_mm[enough[0] if len(enough) else int(np.argmax(areas_mm2))])
    return shape.trim_by_plane([0, 0, 1], z0 + cut_mm), cut_mm
