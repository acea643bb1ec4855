"""What the native library does with a carved grid, in numpy: for machines without it, and to judge it. Pure.

The operations are those of native/src/carve_kernel.c, float32 in the same order.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.cells import Cells
from phone_host.scan.view import View

F: Final = np.float32
Flags = NDArray[np.bool_]


def told(
    cells: Cells, view: View, camera_world: NDArray[np.float32], sigmas: float, clear_m: float
) -> tuple[Flags, Flags, Flags]:
    """Return the cells that a view looked through, those that it found hidden, and those where it has no depth, (Z, Y, X) each.

    Args:
        cells: how the grid lies.
        view: what was seen.
        camera_world: (3, 4) float32 rows of the pose.
        sigmas: standard deviations of a depth that make it clear.
        clear_m: and how far beyond that, m.
    """
    wide, deep, tall = cells.counts
    through, behind, blank = (np.zeros((tall, deep, wide), np.bool_) for _ in range(3))
    along, across, up = (
        first + np.arange(count, dtype=F) * F(cells.side_m)
        for first, count in zip(cells.first_m, cells.counts, strict=True)
    )
    for layer in range(tall):
        through[layer], behind[layer], blank[layer] = _layer(
            view, camera_world, (along, across, up[layer]), (F(sigmas), F(clear_m))
        )
    return through, behind, blank


def _layer(
    view: View,
    pose: NDArray[np.float32],
    at: tuple[NDArray[np.float32], NDArray[np.float32], np.float32],
    limits: tuple[np.float32, np.float32],
) -> tuple[Flags, Flags, Flags]:
    along, across, up = at
    camera = []
    for row in pose:
        start = row[1] * across + row[2] * up + row[3]
        camera.append(start[:, np.newaxis] + row[0] * along)
    depth, focal = camera[2], F(view.geometry.focal_px)
    safe = np.maximum(depth, F(1e-3))
    u = focal * camera[0] / safe + F(view.geometry.cx_px) + F(0.5)
    v = focal * camera[1] / safe + F(view.geometry.cy_px) + F(0.5)
    height, width = view.depth_m.shape
    inside = (depth > F(1e-3)) & (u >= 0) & (v >= 0) & (u < F(width)) & (v < F(height))
    pixels = np.where(inside, v, 0).astype(np.int64) * width + np.where(inside, u, 0).astype(np.int64)
    seen = np.where(inside, view.depth_m.ravel()[pixels].astype(F), F(np.nan))
    sigmas, clear_m = limits
    with np.errstate(invalid="ignore", over="ignore"):
        clear = clear_m + sigmas * F(view.noise_per_m) * seen * seen
        return np.isposinf(seen) | (seen - depth > clear), depth - seen > clear, inside & ~(seen > 0)
