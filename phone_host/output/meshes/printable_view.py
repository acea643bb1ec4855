"""A picture of a mesh from four sides, with what is wrong in red. Pure."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.output.meshes.printable import Points, Triangles

_SIDE_PX: Final = 420
_MARGIN: Final = 0.08
_PAPER: Final = 250
_RED: Final = (48, 48, 214)
_INK: Final = (60, 60, 60)
_SIDES: Final = (("front", 20.0, 15.0), ("left", 110.0, 15.0), ("back", 200.0, 15.0), ("from below", 20.0, -50.0))
"""Name, turn about z and tilt, degrees."""

_LIGHT: Final = np.array([0.3, -0.5, 0.8])
_LEAST_PX: Final = 0.6
"""Distance of the points that are drawn, px: no hole stays between them."""

_MOST: Final = 6_000_000


def picture(points_mm: Points, triangles: Triangles, wrong: NDArray[np.bool_]) -> Image:
    """Draw a mesh as points dense enough to close, the nearest of each pixel in front.

    Args:
        points_mm: (V, 3), z up.
        triangles: (T, 3).
        wrong: (T,) bool: what is drawn red.

    Returns:
        (H, W, 3) uint8 BGR.
    """
    corners = points_mm[triangles]
    middle = (corners.reshape(-1, 3).min(axis=0) + corners.reshape(-1, 3).max(axis=0)) / 2
    corners = corners - middle
    radius = max(float(np.linalg.norm(corners.reshape(-1, 3), axis=1).max()), 1e-9)
    scale = _SIDE_PX * (0.5 - _MARGIN) / radius
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(crosses, axis=1) / 2
    normals = crosses / np.maximum(2 * areas, 1e-12)[:, np.newaxis]
    owner, points = _samples(corners, areas * scale**2 / _LEAST_PX**2)
    lit = 90 + 130 * np.clip(normals @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    colours = np.where(wrong[:, np.newaxis], _RED, np.repeat(lit[:, np.newaxis], 3, axis=1)).astype(np.uint8)
    views = []
    for name, turn, tilt in _SIDES:
        right, ahead, up = _axes(turn, tilt)
        seen = (normals @ ahead < 0)[owner] | wrong[owner]  # what is wrong shows from behind, too
        places = points[seen]
        flat = np.rint(np.column_stack([places @ right, -(places @ up)]) * scale + _SIDE_PX / 2).astype(np.int64)
        order = np.argsort(-(places @ ahead), kind="stable")  # the last one written stays
        image = np.full((_SIDE_PX, _SIDE_PX, 3), _PAPER, np.uint8)
        x, y = flat[order].T
        image[y, x] = colours[owner[seen][order]]
        cv2.putText(image, name, (12, _SIDE_PX - 14), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _INK, 1, cv2.LINE_AA)
        views.append(image)
    return np.vstack([np.hstack(views[:2]), np.hstack(views[2:])])


def _samples(corners: Points, wanted: NDArray[np.float64]) -> tuple[NDArray[np.int64], Points]:
    """Return points spread over the triangles: the triangle of each, and its place."""
    share = min(1.0, _MOST / max(float(np.ceil(wanted).sum()), 1.0))
    counts = np.ceil(wanted * share).astype(np.int64).clip(1)
    owner = np.repeat(np.arange(len(corners)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    # The R2 sequence (Roberts, 2018) fills a square evenly; folded, a triangle.
    u, v = (0.5 + number * 0.7548776662466927) % 1, (0.5 + number * 0.5698402909980532) % 1
    over = u + v > 1
    u, v = np.where(over, 1 - u, u)[:, np.newaxis], np.where(over, 1 - v, v)[:, np.newaxis]
    a, b, c = (corners[owner, corner] for corner in range(3))
    return owner, a + u * (b - a) + v * (c - a)


def _axes(turn_deg: float, tilt_deg: float) -> tuple[Points, Points, Points]:
    """Return to the right, ahead and up of who looks."""
    a, b = np.radians([turn_deg, tilt_deg])
    right = np.array([np.cos(a), np.sin(a), 0])
    ahead = np.array([-np.sin(a) * np.cos(b), np.cos(a) * np.cos(b), -np.sin(b)])
    return right, ahead, np.cross(right, ahead)
