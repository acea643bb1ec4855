"""How much brighter a view is than the model's colours, so that its exposure leaves no seams in them. Pure."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image
from phone_host.scan.blocks import ONE, Blocks
from phone_host.scan.view import View
from phone_host.scan.volume_settings import LEAST_WEIGHT

_STEP_PX: Final = 8
"""4800 pixels of VGA: their median is known to a thousandth, in a millisecond."""

_LEAST: Final = 200
_DARK, _BRIGHT = 16, 239
"""Outside of these a sensor tells no ratio: noise, and what is cut off."""

_MOST: Final = 2.5
"""More than a stop and a third is not exposure, but another thing."""


def gains_of(view: View, world_camera: SE3, blocks: Blocks, voxel_m: float) -> NDArray[np.float64]:
    """Return (3,) by how much a view's blue, green and red are to be multiplied to be the model's: medians over the pixels that show it; 1 where too few do."""
    depth = view.depth_m[::_STEP_PX, ::_STEP_PX].astype(np.float64)
    rows, columns = (_STEP_PX * each for each in np.nonzero(np.isfinite(depth)))
    z, of = view.depth_m[rows, columns].astype(np.float64), view.geometry
    points = np.column_stack([(columns - of.cx_px) * z / of.focal_px, (rows - of.cy_px) * z / of.focal_px, z])
    voxels = np.rint(world_camera.apply(points) / voxel_m).astype(np.int32)
    numbers, at = blocks.locate(voxels)
    safe = np.maximum(numbers, 0)
    known = (numbers >= 0) & (blocks.weights[safe, at] >= LEAST_WEIGHT) & (blocks.field[safe, at] < ONE)
    model, seen = blocks.colours[safe, at][known].astype(np.float64), view.colours[rows, columns][known]
    gains = np.ones(3)
    for channel in range(3):
        here, there = seen[:, channel], model[:, channel]
        usable = (here >= _DARK) & (here <= _BRIGHT) & (there >= _DARK) & (there <= _BRIGHT)
        if usable.sum() >= _LEAST:
            gains[channel] = np.median(there[usable] / here[usable])
    return np.asarray(np.clip(gains, 1 / _MOST, _MOST), np.float64)


def multiplied(colours: Image, gains: NDArray[np.float64]) -> Image:
    """Return colours (H, W, 3), multiplied by (3,) gains and cut off at 255."""
    table = np.clip(np.rint(np.arange(256)[:, np.newaxis] * gains), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(colours, table[np.newaxis]), np.uint8)
