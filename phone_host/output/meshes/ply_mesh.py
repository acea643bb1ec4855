"""PLY with faces: binary is written; whatever `ply_records` reads is read. Pure.

Source: Greg Turk, "The PLY Polygon File Format", 1994.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.byte_order_mark import without_mark
from common.errors import DataError
from phone_host.output.meshes.ply_records import Column, Numbers, ShortError, Table, is_text, read_records
from phone_host.output.meshes.solid import (
    NO_COLOURS,
    NO_FLAGS,
    Solid,
    colours_of_points,
    polygon_triangles,
    sound_solid,
)
from phone_host.output.meshes.text import require_short

_CORNER_LISTS: Final = ("vertex_indices", "vertex_index")
_SHADES: Final = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_WHITE: Final = {"u2": 1 / 257, "f4": 255.0, "f8": 255.0}
"""What a colour is multiplied with to go from 0 to 255, where it is no byte."""

_VERTEX: Final = np.dtype([*((name, "<f4") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue"))])
_BLANKS: Final = np.frombuffer(b"\t\n\v\f\r ", np.uint8)
_FACE: Final = np.dtype([("corners", "u1"), ("numbers", "<i4", 3)])


def ply_bytes(solid: Solid, comment: str) -> bytes:
    """Return a binary PLY file in mm. Another point may come first than in the mesh: assimp 5.2 takes its first bytes for blanks."""
    solid = _begun_well(solid)
    vertices = np.empty(len(solid.points_m), _VERTEX)
    for channel, name in enumerate("xyz"):
        vertices[name] = solid.points_mm[:, channel]
    properties = "property float x\nproperty float y\nproperty float z\n"
    if solid.has_colours:
        for channel, name in enumerate(("red", "green", "blue")):
            vertices[name] = solid.colours[:, channel]
            properties += f"property uchar {name}\n"
    faces = np.empty(len(solid.triangles), _FACE)
    faces["corners"], faces["numbers"] = 3, solid.triangles
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {len(vertices)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    packed = vertices if solid.has_colours else np.ascontiguousarray(solid.points_mm, "<f4")
    return header.encode("ascii", "replace") + packed.tobytes() + faces.tobytes()


def _begun_well(solid: Solid) -> Solid:
    """Return the mesh with a point in front whose first byte is no blank, if there is one."""
    first = np.ascontiguousarray(solid.points_mm[:, 0], "<f4").view(np.uint8)[::4]
    good = np.flatnonzero(~np.isin(first, _BLANKS))
    if not len(good) or good[0] == 0:
        return solid
    order = np.arange(len(first), dtype=np.int32)
    order[[0, good[0]]] = good[0], 0  # its own inverse
    colours = solid.colours[order] if solid.has_colours else solid.colours
    return Solid(solid.points_m[order], order[solid.triangles], colours)


def read_ply_mesh(content: bytes, name: str, unit_m: float) -> Solid:
    """Read a PLY file with faces: polygons or strips of triangles, colours of points or of faces, and which points a scan has seen.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no PLY file, or is cut short, or holds no sound triangle.
    """
    if is_text(content):
        require_short(len(content), name)
    try:
        tables = read_records(without_mark(content))
    except LookupError:
        raise DataError(f"{name} is no PLY file", "give a mesh file") from None
    except ShortError:
        raise DataError(
            f"{name} is cut short, or no PLY file of a mesh", "copy the file again, or export it anew"
        ) from None
    vertices, faces = tables.get("vertex", {}), tables.get("face", {})
    if not all(axis in vertices and vertices[axis].counts is None for axis in "xyz"):
        raise DataError(f"{name} has no points", "give a mesh")
    places = np.stack([np.asarray(vertices[axis].values, np.float64) for axis in "xyz"], axis=1)
    if "tristrips" in tables and not faces:
        triangles = _strip_triangles(next(iter(tables["tristrips"].values()), None))
        return sound_solid(name, places * unit_m, triangles, _colours(vertices))
    counts, corners = _polygons(faces)
    triangles = polygon_triangles(name, places, counts, corners)
    colours = _colours(vertices)
    if len(triangles) and not len(colours) and len(painted := _colours(faces)):
        painted = np.repeat(painted, 3 * np.maximum(counts - 2, 0), axis=0)
        colours = colours_of_points(triangles.ravel(), painted, len(places))
    return sound_solid(name, places * unit_m, triangles, colours, _seen_flags(vertices))


def _polygons(faces: Table) -> tuple[Numbers, Numbers]:
    """Return the numbers of corners, and the corners, of a file's faces."""
    for column in (faces.get(key) for key in _CORNER_LISTS):
        if column is not None and column.counts is not None:
            return column.counts, _integers(column.values)
    return np.zeros(0, np.int64), np.zeros(0, np.int64)


def _integers(values: Numbers) -> Numbers:
    """Return numbers of points; what is no such number becomes -1, which is none either."""
    if values.dtype.kind in "iu":
        return values
    return np.where((values >= 0) & (values < 1 << 31), values, -1).astype(np.int32)


def _strip_triangles(strips: Column | None) -> Numbers:
    """Return the triangles of strips in which each point makes one with the two before it; -1 ends a strip."""
    if strips is None or strips.counts is None:
        return np.zeros((0, 3), np.int64)
    ends = np.cumsum(strips.counts)
    corners = np.insert(strips.values.astype(np.int64), ends[:-1], -1)
    number = np.arange(len(corners))
    begun = np.maximum.accumulate(np.where(corners < 0, number, -1))
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1) if len(corners) > 2 else np.zeros((0, 3), np.int64)  # fmt: skip
    is_odd = (number - begun)[: len(triangles)] % 2 == 0
    triangles[is_odd] = triangles[is_odd][:, [1, 0, 2]]
    return triangles[(triangles >= 0).all(axis=1)]


def _seen_flags(vertices: Table) -> NDArray[np.bool_]:
    """Return (V,): the property `seen` of a scan's model; (0,) where there is none."""
    column = vertices.get("seen")
    return NO_FLAGS if column is None or column.counts is not None else np.asarray(column.values) != 0


def _colours(table: Table) -> NDArray[np.uint8]:
    """Return (N, 3): bytes as they are, words by their upper half, fractions as shares of 255; (0, 3) where there are none."""
    for names in _SHADES:
        shades = [table[name] for name in names if name in table and table[name].counts is None]
        if len(shades) == 3:
            factors = [_WHITE.get(shade.kind, 1.0) for shade in shades]
            values = [
                np.asarray(shade.values, np.float64) * factor for shade, factor in zip(shades, factors, strict=True)
            ]
            return np.asarray(np.rint(np.clip(np.nan_to_num(np.stack(values, axis=1)), 0, 255)), np.uint8)
    return NO_COLOURS
