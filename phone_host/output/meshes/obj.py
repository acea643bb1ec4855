"""Wavefront OBJ: text, with the colours of points behind their places, as MeshLab, Blender and slicers read it. Pure.

Source: "Object Files (.obj)", Wavefront Advanced Visualizer Manual, appendix B1; "v x y z r g b" is a wide-spread extension.
"""

import io
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.meshes.solid import Solid, sound_solid

_MOST_CORNERS: Final = 64
"""Of one face; a longer one is no face of a scan."""


def obj_bytes(solid: Solid, comment: str) -> bytes:
    """Return an OBJ file in mm.

    Args:
        solid: the mesh.
        comment: stands at its head, one line.
    """
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
    """Read the points, colours and faces of an OBJ file; a face of more than three corners becomes a fan.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m.

    Raises:
        DataError: it is no OBJ file, or holds no sound triangle.
    """
    points: list[list[float]] = []
    corners: list[tuple[int, int, int]] = []
    for number, line in enumerate(content.splitlines(), start=1):
        word, _, rest = line.partition(b" ")
        try:
            if word == b"v":
                points.append([float(part) for part in rest.split()])
            elif word == b"f":
                corners += _fan(rest, len(points))
        except ValueError:
            raise DataError(f"{name} is no OBJ file: line {number} is not read", "export it anew") from None
    lengths = {len(point) for point in points}
    if not lengths <= {3, 4, 6, 7}:
        raise DataError(f"{name} is no OBJ file: a point has not three numbers", "export it anew")
    places = np.array([point[:3] for point in points], np.float64).reshape(-1, 3) * unit_m
    return sound_solid(name, places, np.array(corners, np.int64).reshape(-1, 3), _colours(points, lengths))


def _colours(points: list[list[float]], lengths: set[int]) -> NDArray[np.uint8]:
    if lengths != {6}:
        return np.zeros((0, 3), np.uint8)
    shares = np.array([point[3:] for point in points])
    return np.asarray(np.rint(255 * np.clip(np.nan_to_num(shares), 0, 1)), np.uint8)


def _fan(rest: bytes, count: int) -> list[tuple[int, int, int]]:
    """Return the triangles of a face; numbers below zero count back from the newest point."""
    words = rest.split(maxsplit=_MOST_CORNERS)
    if not 3 <= len(words) <= _MOST_CORNERS:
        raise ValueError("a face")
    numbers = [int(word.partition(b"/")[0]) for word in words]
    places = [number - 1 if number > 0 else count + number for number in numbers]
    return [(places[0], places[at], places[at + 1]) for at in range(1, len(places) - 1)]
