"""How exactly the surface is known at each point, from what the volume has counted there. Pure."""

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import SIDE, Blocks
from phone_host.scan.volume_settings import WEIGHT_ONE, VolumeSettings


def surface_noise_m(points_m: NDArray[np.float32], blocks: Blocks, settings: VolumeSettings) -> NDArray[np.float32]:
    """Return the standard deviation of the surface, if the views err independently.

    A depth's weight is the inverse of its variance (`volume_settings`), so a sum of weights tells that of their mean.

    Args:
        points_m: (N, 3) points of the surface, m.
        blocks: of the volume.
        settings: of the volume.

    Returns:
        (N,) m; NaN where the volume holds nothing.
    """
    voxels = np.rint(points_m / settings.voxel_m).astype(np.int32)
    numbers, inside = blocks.find(voxels >> 3), voxels & (SIDE - 1)
    at = inside @ np.array([1, SIDE, SIDE**2])
    weights = np.where(numbers >= 0, blocks.weights[np.maximum(numbers, 0), at], 0).astype(np.float64)
    with np.errstate(divide="ignore"):
        noise = settings.sure_m * np.sqrt(WEIGHT_ONE / weights)
    return np.where(weights > 0, noise, np.nan).astype(np.float32)
