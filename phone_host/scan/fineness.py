"""How fine a model is made, from how exact its first view's depths are. Pure."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings

_NEAR_SHARE: Final = 0.25
"""The model is as fine as the nearest quarter of the first view's depths deserves: what is scanned stands before its background."""

_TRUNCATION_VOXELS: Final = 6.0
"""A table seen at 15 degrees needs as many: along such a ray 4 voxels are one voxel deep, and 4 pixels in 10 find no surface."""

_MOST_TRUNCATION_VOXELS: Final = 14.0
"""Room is made in steps of half a truncation, and these must not pass over a block of 8 voxels."""

_SIGMAS: Final = 3.0
_LEAST_VOXEL_M, _MOST_VOXEL_M = 0.0005, 0.05
_STEPS_PER_TEN: Final = 20


def fineness_for(view: View, voxel_m: float, most_bytes: int) -> VolumeSettings:
    """Choose how a model is made.

    Args:
        view: the first one; some pixel has a depth.
        voxel_m: as asked for, m; NaN: half the noise of the near depths.
        most_bytes: memory of the blocks at most.

    Returns:
        Settings. Depths count as far as their noise is no greater than the distance to which the field tells the surface.
    """
    near_m = float(np.nanquantile(view.depth_m, _NEAR_SHARE))
    noise_m = view.noise_per_m * near_m**2
    if math.isnan(voxel_m):
        voxel_m = _rounded(min(max(noise_m / 2, _LEAST_VOXEL_M), _MOST_VOXEL_M))
    truncation = min(max(_TRUNCATION_VOXELS, _SIGMAS * noise_m / voxel_m), _MOST_TRUNCATION_VOXELS)
    far_m = max(math.sqrt(truncation * voxel_m / view.noise_per_m), near_m)
    return VolumeSettings(voxel_m=voxel_m, far_m=far_m, most_bytes=most_bytes, truncation_voxels=truncation)


def thinner(settings: VolumeSettings, share: float) -> VolumeSettings:
    """Return settings of a field that tells the surface over a share of the distance: for a thing whose poses need no wide bridge, and that would be fattened.

    Args:
        settings: from `fineness_for`.
        share: of its truncation, 0.5 to 1.
    """
    return replace(settings, truncation_voxels=share * settings.truncation_voxels)


def _rounded(length_m: float) -> float:
    """Round to one of 20 lengths a decade: 1, 1.1, 1.3, 1.4 ... so that alike rigs give alike models."""
    step = round(math.log10(length_m) * _STEPS_PER_TEN)
    return float(f"{10 ** (step / _STEPS_PER_TEN):.2g}")
