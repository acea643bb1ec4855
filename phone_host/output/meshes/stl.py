"""STL: triangles alone, without unit, colour or shared points; binary is written, binary and text are read, as writers of many kinds leave them. Pure.

Source: "The StL Format", 3D Systems, 1989: 80 bytes of header, a count, then 50 bytes a triangle.
"""

import re
from array import array
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.byte_order_mark import without_mark
from common.errors import DataError
from common.words import counted
from phone_host.output.meshes.solid import Solid, require_triangles, sound_solid, welded
from phone_host.output.meshes.text import require_short, text_lines

_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER: Final = 80
_COUNTS_NOT_SET: Final = (0, 0xFFFFFFFF)
"""What writers leave there that do not go back to the header."""

_NAMED: Final = re.compile(rb"\s*(?:end\s*)?solid\b")
_FACETS: Final = re.compile(rb"\bfacet\s+normal\s+[-+.\dni].*?(?=\bend\s*solid\b|$)", re.DOTALL)
"""From a facet, which begins with its normal (a number, nan or inf), to the end of its solid."""

_SOLID_END: Final = re.compile(rb"\bend\s*solid\b")
_TEXT_HEAD: Final = 512
"""A binary file has a zero byte here: it is in the count, or in the first triangles' attributes."""


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

    Binary or text is told apart by the bytes: many programs begin binary files with "solid", too.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no STL file, or is cut short, or holds no sound triangle.
    """
    head = without_mark(content[:_TEXT_HEAD])
    is_text = head.lstrip().lower().startswith(b"solid") and b"\0" not in head
    corners = _text(content, name) if is_text else _binary(content, name)
    triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    solid = welded(sound_solid(name, np.multiply(corners, unit_m, dtype=np.float64), triangles))
    return Solid(solid.points_m, require_triangles(name, solid.triangles), solid.colours)


def _binary(content: bytes, name: str) -> NDArray[np.float32]:
    """Return (3 T, 3). Bytes behind the last triangle mean nothing; of a count that was never set, the file's length says what it is."""
    body = len(content) - _HEADER - 4
    if body < 0:
        raise _cut_error(name)
    count, held = int.from_bytes(content[_HEADER : _HEADER + 4], "little"), body // _TRIANGLE.itemsize
    if count in _COUNTS_NOT_SET and body == held * _TRIANGLE.itemsize:
        count = held
    if count > held:
        raise DataError(
            f"{name} is cut short: its header names {counted(count, 'triangle')}, {held} are there",
            "copy the file again",
        )
    if body == held * _TRIANGLE.itemsize and any(content[_HEADER + 4 + count * _TRIANGLE.itemsize :]):
        raise DataError(f"{name} holds {held} triangles, but its header names {count}", "export it anew")
    return np.frombuffer(content, _TRIANGLE, count, _HEADER + 4)["corners"].reshape(-1, 3)


def _text(content: bytes, name: str) -> NDArray[np.float64]:
    """Return (3 T, 3). The last line may be missing, half a triangle not."""
    require_short(len(content), name)
    corners, opened, closed = array("d"), 0, 0
    try:
        for line in text_lines(without_mark(content)):
            words = iter(_behind_names(line.lower()).split())
            before = b""
            for word in words:
                if word == b"vertex":
                    corners.extend([float(next(words)), float(next(words)), float(next(words))])
                elif word == b"endfacet" or (before, word) == (b"end", b"facet"):
                    closed += 1
                else:
                    opened += word == b"facet"
                before = word
    except (ValueError, StopIteration):
        if not _SOLID_END.search(content[-_TEXT_HEAD:].lower()):
            raise _cut_error(name) from None
        raise DataError(f"{name} has a vertex that is no number", "export it anew") from None
    if opened != closed:
        raise _cut_error(name)
    if len(corners) % 9:
        raise DataError(f"{name} has a triangle without three corners", "export it anew")
    return np.frombuffer(corners, np.float64).reshape(-1, 3)


def _behind_names(line: bytes) -> bytes:
    """Return a line without the name of a solid, which may have any words; facets may follow on the same line."""
    if not _NAMED.match(line):
        return line
    return b" ".join(facets[0] for facets in _FACETS.finditer(line))


def _cut_error(name: str) -> DataError:
    return DataError(f"{name} is no whole STL file", "copy the file again, or export it anew")
