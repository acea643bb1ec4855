"""Meshes of several parts, each moved to its place: what GLB and 3MF hold. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.meshes.solid import NO_COLOURS, Solid, require_corners, sound_solid

_MAX_PLACED: Final = 20_000_000
"""Triangles of one mesh, or its points."""

_MAX_REPEATED: Final = 4_000_000
"""The same where parts are placed more than once, by which a small file names an endless mesh: 400 MB of memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Triangles, and where they go.

    Attributes:
        points: (V, 3), in the file's unit.
        triangles: (T, 3) numbers of its points.
        colours: (V, 3) or (0, 3) uint8.
        transform: (4, 4) float64: from its coordinates to the whole mesh's.
    """

    points: NDArray[Any]
    triangles: NDArray[np.integer[Any]]
    colours: NDArray[np.uint8]
    transform: NDArray[np.float64]


def require_count(name: str, count: int, limit: int = _MAX_PLACED) -> None:
    """Check a number of points or triangles before there is room made for them.

    Raises:
        DataError: it is beyond the limit.
    """
    if count > limit:
        raise DataError(f"{name} holds more than {limit / 1e6:.0f} million points or triangles", "export fewer")


def assemble(name: str, parts: Sequence[Part], unit_m: float) -> Solid:
    """Put parts together.

    Args:
        name: of the file, for errors.
        parts: of it; where some have colours and others have none, those are white.
        unit_m: their unit, m.

    Returns:
        One mesh. A part that is mirrored by its transform has its triangles turned, so that outside stays outside.

    Raises:
        DataError: they hold no sound triangle, or too many.
    """
    limit = _MAX_REPEATED if len({id(part.triangles) for part in parts}) < len(parts) else _MAX_PLACED
    require_count(name, max(sum(len(part.points) for part in parts), sum(len(part.triangles) for part in parts)), limit)
    has_colours = any(len(part.colours) for part in parts)
    points, triangles, colours, count = [], [], [], 0
    for part in parts:
        require_corners(name, part.triangles, len(part.points))
        points_m = part.points.astype(np.float64) @ (part.transform[:3, :3].T * unit_m) + part.transform[:3, 3] * unit_m
        turned = part.triangles[:, ::-1] if np.linalg.det(part.transform[:3, :3]) < 0 else part.triangles
        points.append(points_m)
        triangles.append(turned.astype(np.int32) + np.int32(count) if count else turned.astype(np.int32, copy=False))
        if has_colours:
            colours.append(part.colours if len(part.colours) else np.full((len(part.points), 3), 255, np.uint8))
        count += len(part.points)
    if not triangles:
        raise DataError(f"{name} holds no triangle", "give a mesh, not points alone")
    shades = _concatenate(colours) if colours else NO_COLOURS
    return sound_solid(name, _concatenate(points), _concatenate(triangles), shades)


def _concatenate(arrays: list[NDArray[Any]]) -> NDArray[Any]:
    """Return the rows of all; of one array itself, which most files have, no copy."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
