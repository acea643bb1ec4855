"""One pair as a plaque to print: its depth as heights on a plate. Pure.

One view knows the front of things only, so a closed thing of it would be half invented. A relief invents nothing: what has no depth is the bare
plate. It is orthographic, so that no part stands over another; one pixel is as wide as at the middle depth.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import CloudImage, Image
from phone_host.output.meshes.solid import Solid

_MOST_NODES: Final = 480
"""Along the longer side: 0.2 mm apart on a plaque of 100 mm, half a nozzle."""

_LEAST_SHARE: Final = 0.05
_ENDS: Final = (2, 98)
"""Percentiles of the depth between which the relief lies: single wrong depths must not flatten all the rest."""

_MEDIAN_PX: Final = 5
_LEAST_DEPTH_M: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """What the plaque measures.

    Attributes:
        width_m: its longer side, m.
        height_m: of the relief above the plate at most, m: a street would be a tower.
        base_m: thickness of the plate, m.
    """

    width_m: float
    height_m: float
    base_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """A plaque.

    Attributes:
        solid: closed; x right, y up, z out of the plate; m.
        scale: its size as a share of the scene's.
        flattened: its heights as a share of the scene's depth at that scale, 0..1; 1: true to scale.
        covered: share of the plate that has a depth, 0..1.
    """

    solid: Solid
    scale: float
    flattened: float
    covered: float


def relief_of(cloud: CloudImage, colours: Image, focal_px: float, sizes: Sizes) -> Relief:
    """Make a plaque of a pair.

    Args:
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: the rectified left image.
        focal_px: of that image, px.
        sizes: of the plaque.

    Raises:
        DataError: too little of the picture has a depth.
    """
    depth, tint = _reduced(cloud[..., 2], colours)
    height_px, width_px = depth.shape
    known = np.isfinite(depth)
    covered = float(known.mean())
    if covered < _LEAST_SHARE:
        raise DataError(
            f"{covered:.0%} of the picture has a depth, which makes no relief",
            "look at phone-host stereo's page for why",
        )
    near_m, far_m = np.percentile(depth[known], _ENDS)
    step = cloud.shape[1] / width_px
    pixel_m = float(np.median(depth[known])) * step / focal_px
    scale = sizes.width_m / (max(width_px, height_px) - 1) / pixel_m
    flattened = min(1.0, sizes.height_m / max(scale * float(far_m - near_m), _LEAST_DEPTH_M))
    heights = np.where(known, far_m - np.clip(np.nan_to_num(depth, nan=far_m), near_m, far_m), 0).astype(np.float32)
    heights = cv2.medianBlur(heights, _MEDIAN_PX) * (scale * flattened) + sizes.base_m
    return Relief(_plaque(heights, pixel_m * scale, tint), scale, flattened, covered)


def _reduced(depth: NDArray[np.float32], colours: Image) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Take every n-th pixel where there are more than a print can show; colours as RGB."""
    every = -(-max(depth.shape) // _MOST_NODES)
    tint = colours[::every, ::every]
    rgb = np.repeat(tint[..., np.newaxis], 3, axis=2) if tint.ndim == 2 else tint[..., ::-1]
    return depth[::every, ::every], np.ascontiguousarray(rgb)


def _plaque(heights: NDArray[np.float32], pixel_m: float, tint: NDArray[np.uint8]) -> Solid:
    """Close a field of heights by four walls and a floor of two triangles a cell, which a slicer merges."""
    rows, columns = heights.shape
    y, x = np.mgrid[0:rows, 0:columns]
    place = np.stack([x - (columns - 1) / 2, (rows - 1) / 2 - y], axis=-1).reshape(-1, 2) * pixel_m
    top = np.column_stack([place, heights.ravel()])
    floor = np.column_stack([place, np.zeros(rows * columns)])
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1].ravel(), number[:-1, 1:].ravel(), number[1:, 1:].ravel(), number[1:, :-1].ravel()
    over = np.concatenate([np.column_stack([a, d, c]), np.column_stack([a, c, b])])
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    after, below = np.roll(rim, -1), rows * columns
    walls = np.concatenate(
        [np.column_stack([rim, after, after + below]), np.column_stack([rim, after + below, rim + below])]
    )
    triangles = np.concatenate([over, over[:, ::-1] + below, walls]).astype(np.int32)
    shades = np.concatenate([tint.reshape(-1, 3)] * 2)
    return Solid(np.concatenate([top, floor]).astype(np.float32), triangles, shades)
