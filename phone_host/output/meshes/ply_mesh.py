"""PLY with triangles: binary is written; binary of either byte order and text are read, whatever their properties. Pure.

Source: Greg Turk, "The PLY Polygon File Format", 1994.
"""

import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.meshes.solid import Solid, sound_solid

_TYPES: Final = {
    **dict.fromkeys((b"char", b"int8"), "i1"), **dict.fromkeys((b"uchar", b"uint8"), "u1"),
    **dict.fromkeys((b"short", b"int16"), "i2"), **dict.fromkeys((b"ushort", b"uint16"), "u2"),
    **dict.fromkeys((b"int", b"int32"), "i4"), **dict.fromkeys((b"uint", b"uint32"), "u4"),
    **dict.fromkeys((b"float", b"float32"), "f4"), **dict.fromkeys((b"double", b"float64"), "f8"),
}  # fmt: skip
_ORDERS: Final = {b"binary_little_endian": "<", b"binary_big_endian": ">", b"ascii": ""}
_END: Final = re.compile(rb"end_header\r?\n")
_MOST_HEADER: Final = 16384
_CORNER_LISTS: Final = (b"vertex_indices", b"vertex_index")
_VERTEX: Final = np.dtype([*((name, "<f4") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue"))])
_BLANKS: Final = np.frombuffer(b"\t\n\v\f\r ", np.uint8)
_FACE: Final = np.dtype([("corners", "u1"), ("numbers", "<i4", 3)])


def ply_bytes(solid: Solid, comment: str) -> bytes:
    """Return a binary PLY file in mm. Another point may come first than in the mesh: assimp 5.2 takes its first bytes for blanks.

    Args:
        solid: the mesh.
        comment: stands in its header, one line.
    """
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


@dataclass(frozen=True, slots=True)
class _Element:
    """One kind of thing in a file: its number, and its properties as (name, type) or (name, type of count, type)."""

    name: bytes
    count: int
    properties: tuple[tuple[bytes, ...], ...]


def read_ply_mesh(content: bytes, name: str, unit_m: float) -> Solid:
    """Read a PLY file with triangles.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no PLY file, or is cut short, or holds no sound triangle.
    """
    end = _END.search(content[:_MOST_HEADER])
    if not content.startswith(b"ply") or end is None:
        raise DataError(f"{name} is no PLY file", "give a mesh file")
    try:
        order, elements = _header(content[: end.start()])
        tables = _text(content[end.end() :], elements) if not order else _binary(content, end.end(), order, elements)
    except (ValueError, KeyError, IndexError, OverflowError):
        raise DataError(
            f"{name} is cut short, or no PLY file of a mesh", "copy the file again, or export it anew"
        ) from None
    vertices, faces = tables.get(b"vertex", {}), tables.get(b"face", {})
    if not all(axis in vertices for axis in (b"x", b"y", b"z")):
        raise DataError(f"{name} has no points", "give a mesh")
    places = np.column_stack([vertices[axis].astype(np.float64) for axis in (b"x", b"y", b"z")]) * unit_m
    corners = next((faces[key] for key in _CORNER_LISTS if key in faces), np.zeros((0, 3), np.int64))
    shades = [vertices[key] for key in (b"red", b"green", b"blue") if key in vertices]
    is_coloured = len(shades) == 3 and all(shade.dtype == np.uint8 for shade in shades)
    colours = np.asarray(np.column_stack(shades) if is_coloured else np.zeros((0, 3)), np.uint8)
    return sound_solid(name, places, corners.astype(np.int64), colours)


def _header(head: bytes) -> tuple[str, list[_Element]]:
    order, elements = "", list[_Element]()
    for line in head.splitlines()[1:]:
        words = line.split()
        if not words or words[0] in {b"comment", b"obj_info"}:
            continue
        if words[0] == b"format":
            order = _ORDERS[words[1]]
        elif words[0] == b"element":
            elements.append(_Element(words[1], int(words[2]), ()))
        elif words[0] == b"property":
            last = elements[-1]
            given = (words[4], words[2], words[3]) if words[1] == b"list" else (words[2], words[1])
            elements[-1] = _Element(last.name, last.count, (*last.properties, given))
        else:
            raise ValueError("a header's line")
    if any(not 0 <= element.count < 1 << 31 for element in elements):
        raise ValueError("a count")
    return order, elements


Table = dict[bytes, NDArray[np.generic]]


def _binary(content: bytes, at: int, order: str, elements: list[_Element]) -> dict[bytes, Table]:
    """Read the elements one after another. A list is read as triangles, which all faces are in a mesh of a scan."""
    tables: dict[bytes, Table] = {}
    for element in elements:
        fields: list[tuple[str, str] | tuple[str, str, int]] = []
        lists = []
        for number, (_, *kinds) in enumerate(element.properties):
            if len(kinds) == 1:
                fields.append((f"f{number}", order + _TYPES[kinds[0]]))
            else:
                fields += [(f"n{number}", order + _TYPES[kinds[0]]), (f"f{number}", order + _TYPES[kinds[1]], 3)]
                lists.append(f"n{number}")
        record = np.dtype(fields)
        rows = np.frombuffer(content, record, element.count, at)
        if any((rows[counts] != 3).any() for counts in lists):
            raise ValueError("a face is no triangle")
        at += element.count * record.itemsize
        tables[element.name] = {title: rows[f"f{number}"] for number, (title, *_) in enumerate(element.properties)}
    return tables


def _text(body: bytes, elements: list[_Element]) -> dict[bytes, Table]:
    lines = iter(body.splitlines())
    tables: dict[bytes, Table] = {}
    for element in elements:
        rows = [next(lines, b"").split() for _ in range(min(element.count, len(body)))]
        if len(rows) < element.count:
            raise ValueError("too few lines")
        if len(element.properties) == 1 and len(element.properties[0]) == 3:
            if any(int(row[0]) != 3 for row in rows):
                raise ValueError("a face is no triangle")
            tables[element.name] = {
                element.properties[0][0]: np.array([[int(n) for n in row[1:4]] for row in rows], np.int64)
            }
            continue
        tables[element.name] = {
            title: np.array([float(row[at]) for row in rows]).astype(_TYPES[kinds[-1]])
            for at, (title, *kinds) in enumerate(element.properties)
            if len(kinds) == 1
        }
    return tables
