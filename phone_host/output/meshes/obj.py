"""Wavefront OBJ: text, with the colours of points behind their places, as MeshLab, Blender and slicers read it. Pure.

Source: "Object Files (.obj)", Wavefront Advanced Visualizer Manual, appendix B1; "v x y z r g b" is a wide-spread extension.
"""

import io
import re
from array import array
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.byte_order_mark import without_mark
from common.errors import DataError
from phone_host.output.meshes.solid import NO_COLOURS, Solid, polygon_triangles, sound_solid
from phone_host.output.meshes.text import require_short, text_lines

_NUMBERS: Final = (3, 4, 6, 7)
"""Of a point: three, perhaps a weight that polygons do not heed, or a colour, perhaps with its opacity."""


_FIGURE: Final = re.compile(rb"\s*(?:v|fo?)[\s\\]", re.IGNORECASE)
"""The first line of a point or a face, of which `fo` is the name in old files."""


def obj_bytes(solid: Solid, comment: str) -> bytes:
    """Return an OBJ file in mm."""
    text = io.StringIO()
    text.write(f"# {comment}\n")
    points = solid.points_mm
    if solid.has_colours:
        rows = np.column_stack([points, solid.colours / 255])
        np.savetxt(text, rows, fmt="v %.5f %.5f %.5f %.4f %.4f %.4f")
    else:
        np.savetxt(text, points, fmt="v %.5f %.5f %.5f")
    np.savetxt(text, solid.triangles + 1, fmt="f %d %d %d")
    return text.getvalue().encode("ascii")


def read_obj(content: bytes, name: str, unit_m: float) -> Solid:
    """Read the points, their colours and the faces of an OBJ file. What else is in it, such as materials, has no part in its shape.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no OBJ file, or holds no sound triangle.
    """
    require_short(len(content), name)
    points, shades, counts, corners = array("d"), array("d"), array("q"), array("q")
    for number, line in _statements(without_mark(content)):
        words = line.partition(b"#")[0].split()
        word = words[0].lower() if words else b""
        try:
            if word == b"v":
                values = [float(part) for part in words[1:]]
                if len(values) not in _NUMBERS:
                    raise DataError(f"{name} is no OBJ file: a point has not three numbers", "export it anew")
                points.extend(values[:3])
                shades.extend(values[3:6] if len(values) > 4 else ())
            elif word in {b"f", b"fo"}:
                counts.append(len(words) - 1)
                corners.extend(_corners(words, len(points) // 3))
        except (ValueError, OverflowError):
            raise DataError(f"{name} is no OBJ file: line {number} is not read", "export it anew") from None
    places = np.frombuffer(points, np.float64).reshape(-1, 3) if points else np.zeros((0, 3))
    faces = polygon_triangles(name, places, np.array(counts), np.array(corners))
    return sound_solid(name, places * unit_m, faces, _colours(shades, len(places)))


def _statements(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield statements, each with the number of the line where it begins.

    A backslash continues a point or a face, also behind a comment. In a name or a comment it is part of a path.
    """
    first, parts = 0, list[bytes]()
    for number, line in enumerate(text_lines(content), start=1):
        begin = line.rstrip()
        if begin.endswith(b"\\") and b"#" not in line and (parts or _FIGURE.match(begin)):
            first = first if parts else number
            parts.append(begin[:-1])
        elif parts and line.lstrip().startswith(b"#"):
            continue
        elif parts:
            yield first, b" ".join([*parts, line])
            parts = []
        else:
            yield number, line
    yield first, b" ".join(parts)


def _corners(words: list[bytes], count: int) -> list[int]:
    """Return a face's corners; numbers below zero count back from the newest point, and none is zero."""
    numbers = [int(word.partition(b"/")[0]) for word in words[1:]]
    if 0 in numbers:
        raise ValueError("no point has the number 0")
    return [number - 1 if number > 0 else count + number for number in numbers]


def _colours(shades: "array[float]", count: int) -> NDArray[np.uint8]:
    """Return (V, 3), or none where not each point has one. They go to 1, of a few writers to 255."""
    if not count or len(shades) != 3 * count:
        return NO_COLOURS
    shares = np.nan_to_num(np.frombuffer(shades, np.float64).reshape(-1, 3))
    return np.asarray(np.rint(np.clip(shares if shares.max() > 1 else 255 * shares, 0, 255)), np.uint8)
