"""A surface seen from above its front, in as few pixels as a terminal has characters. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import rotations_of
from phone_host.scan.mesh import Mesh

_TURN: Final = (-0.35, 0.3, 0.0)
"""Rotation vector, rad: seen from a little above and aside, so that depth shows."""

_MARGIN: Final = 0.02
_SEEN: Final = (0.01, 0.99)
"""Shares of the points between which the picture reaches: crumbs far away would make the rest small."""


@dataclass(frozen=True, slots=True, eq=False)
class SmallView:
    """A picture.

    Attributes:
        colours: (H, W, 3) uint8, red green blue.
        is_seen: (H, W) whether there is a surface.
    """

    colours: NDArray[np.uint8]
    is_seen: NDArray[np.bool_]


def small_view(meshes: Iterable[Mesh], width_px: int, height_px: int) -> SmallView:
    """Draw the points of a surface, the nearest of each pixel.

    Args:
        meshes: its parts; x right, y down, z forward.
        width_px: of the picture, >= 1.
        height_px: likewise; pixels are square.
    """
    colours = np.zeros((height_px, width_px, 3), np.uint8)
    is_seen = np.zeros((height_px, width_px), np.bool_)
    parts = [mesh for mesh in meshes if len(mesh.points_m)]
    if not parts:
        return SmallView(colours, is_seen)
    points = np.concatenate([mesh.points_m for mesh in parts]).astype(np.float64)
    turned = (points - np.median(points, axis=0)) @ rotations_of(np.array(_TURN)).T
    low, high = np.quantile(turned[:, :2], _SEEN, axis=0)
    step = max((high - low) / (np.array([width_px, height_px]) * (1 - 2 * _MARGIN)))
    if not step > 0:
        return SmallView(colours, is_seen)
    middle = np.array([width_px, height_px]) / 2
    at = np.floor((turned[:, :2] - (low + high) / 2) / step + middle).astype(np.int64)
    inside = np.flatnonzero(((at >= 0) & (at < (width_px, height_px))).all(axis=1))
    farthest_first = inside[np.argsort(-turned[inside, 2], kind="stable")]
    x, y = at[farthest_first].T
    colours[y, x] = np.concatenate([mesh.colours for mesh in parts])[farthest_first]  # the last one, the nearest, stays
    is_seen[y, x] = True
    return SmallView(colours, is_seen)
