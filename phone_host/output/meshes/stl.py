"""STL: triangles alone, without unit, colour or shared points; binary is written, binary and text are read. Pure.

Source: "The StL Format", 3D Systems, 1989: 80 bytes of header, a count, then 50 bytes a triangle.
"""

import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.words import counted
from phone_host.output.meshes.solid import Solid, sound_solid, welded

_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER: Final = 80
_VERTEX: Final = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def stl_bytes(solid: Solid, comment: str) -> bytes:
    """Return a binary STL file in mm.

    Args:
        solid: the mesh.
        comment: stands in its header, at most 80 ASCII letters.
    """
    records = np.zeros(len(solid.triangles), _TRIANGLE)
    records["corners"] = solid.points_mm[solid.triangles]
    records["normal"] = _normals(records["corners"])
    # A header that begins with "solid" would be taken for text.
    header = comment.encode("ascii", "replace")[:_HEADER].ljust(_HEADER)
    return header + np.uint32(len(records)).tobytes() + records.tobytes()


def _normals(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    wide = corners.astype(np.float64)
    normals = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return (normals / np.where(lengths > 0, lengths, 1)).astype(np.float32)


def read_stl(content: bytes, name: str, unit_m: float) -> Solid:
    """Read a binary or text STL file; points at one place become one.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no STL file, or is cut short, or holds no sound triangle.
    """
    if len(content) >= _HEADER + 4:
        count = int.from_bytes(content[_HEADER : _HEADER + 4], "little")
        expected = _HEADER + 4 + count * _TRIANGLE.itemsize
        if expected <= len(content) and (expected == len(content) or not content.startswith(b"solid")):
            corners = np.frombuffer(content, _TRIANGLE, count, _HEADER + 4)["corners"].reshape(-1, 3)
            return _soup(corners.astype(np.float64), name, unit_m)
        if not content.startswith(b"solid"):
            raise DataError(
                f"{name} is cut short: its header names {counted(count, 'triangle')}, {max(0, len(content) - _HEADER - 4) // _TRIANGLE.itemsize} are there",
                "copy the file again",
            )
    if not content.lstrip().startswith(b"solid") or b"endsolid" not in content:
        raise DataError(f"{name} is no whole STL file", "copy the file again, or export it anew")
    try:
        corners = np.array(
            [[float(number) for number in one.groups()] for one in _VERTEX.finditer(content)], np.float64
        )
    except ValueError:
        raise DataError(f"{name} has a vertex that is no number", "export it anew") from None
    if len(corners) % 3:
        raise DataError(f"{name} has a triangle without three corners", "export it anew")
    return _soup(corners.reshape(-1, 3), name, unit_m)


def _soup(corners: NDArray[np.float64], name: str, unit_m: float) -> Solid:
    triangles = np.arange(len(corners)).reshape(-1, 3)
    return _sound(welded(sound_solid(name, corners * unit_m, triangles, np.zeros((0, 3), np.uint8))), name)


def _sound(solid: Solid, name: str) -> Solid:
    if not len(solid.triangles):
        raise DataError(f"{name} holds no triangle with three corners", "give a mesh, not points alone")
    return solid
