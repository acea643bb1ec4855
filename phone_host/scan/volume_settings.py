"""How fine a volume is, how far it sees, and how much memory it may take: as asked for, or as exact and as far as its first view's depths are. Pure."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.scan.blocks import BLOCK_BYTES
from phone_host.scan.view import View

WEIGHT_ONE: Final = 64.0
"""A sure depth's weight; a depth with eight times the noise still counts 1."""

MOST_WEIGHT: Final = 4096
"""At which a voxel's weight stays: 64 sure depths. So what moves away is forgotten in the end, and 16 bit hold the mean exactly enough."""

LEAST_WEIGHT: Final = 8
"""Of a voxel on the surface: an eighth of a sure depth. One view at a slant gives less, and is off by 5 mm where others are off by 4."""

STREET_NEAR_M: Final = 5.0
"""The nearest quarter of the depths ends here or beyond: in a street 8 to 11 m, in two rooms 1.4 to 1.7 m."""

_SURE_VOXELS: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class VolumeSettings:
    """How a volume is made.

    Attributes:
        voxel_m: distance of two values, m, > 0; about half the noise of the depths or more.
        far_m: depths beyond it are not fused, m.
        most_bytes: memory of the blocks at most.
        truncation_voxels: distance from the surface, voxels, to which the field tells it; three or four standard deviations of the farthest
            depths, but thin parts must be thicker than that.
        near_m: depth at which the nearest quarter of the first view's depths ends, m; 0: not known.
        noise_per_m: noise of the rig's depths 1 m away, m; 0: not known. Neither follows from voxels and reach, which the user may choose, and which
            change where the memory is full.
    """

    voxel_m: float = 0.01
    far_m: float = 4.0
    most_bytes: int = 300_000_000
    truncation_voxels: float = 4.0
    near_m: float = 0.0
    noise_per_m: float = 0.0

    @property
    def truncation_m(self) -> float:
        """Distance from the surface, m, to which the field tells it."""
        return self.truncation_voxels * self.voxel_m

    @property
    def sure_m(self) -> float:
        """A depth whose noise is this or less, m, has the full weight."""
        return _SURE_VOXELS * self.voxel_m

    @property
    def is_of_street(self) -> bool:
        """Whether the near depths are those of a street: corners tell poses better there than its wide voxels do."""
        return self.near_m >= STREET_NEAR_M

    @property
    def coarser(self) -> "VolumeSettings":
        """The same with voxels twice as wide, and a surface that is told over as many of them."""
        return replace(self, voxel_m=2 * self.voxel_m)

    @property
    def most_blocks(self) -> int:
        """Blocks that the memory holds."""
        return max(self.most_bytes // BLOCK_BYTES, 1)


_NEAR_SHARE: Final = 0.25
"""The model is as fine as the nearest quarter of the first view's depths deserves: what is scanned stands before its background."""

_FAR_SHARE: Final = 0.75
"""Where the near depths are those of a street, the model reaches to the farthest quarter: of what a car sees 10 m away, half has left the picture after
4 m. With 15 m of reach 3 of 24 pairs of a street that is driven backwards found a partner for enough of their pixels, with 33 m all of them."""

_TRUNCATION_VOXELS: Final = 6.0
"""A table seen at 15 degrees needs as many: along such a ray 4 voxels are one voxel deep, and 4 pixels in 10 find no surface."""

_MOST_TRUNCATION_VOXELS: Final = 14.0
"""Room is made in steps of half a truncation, and these must not pass over a block of 8 voxels."""

_SIGMAS: Final = 3.0
_LEAST_VOXEL_M, _MOST_VOXEL_M = 0.0005, 0.25
_STEPS_PER_TEN: Final = 20


def fineness_for(view: View, voxel_m: float, most_bytes: int) -> VolumeSettings:
    """Choose how a model is made.

    Args:
        view: the first one; some pixel has a depth.
        voxel_m: as asked for, m; NaN: half the noise of the near depths, in a street a sixth of the noise of the far ones if that is more.
        most_bytes: memory of the blocks at most.

    Returns:
        Settings. Depths count as far as their noise is no greater than the distance to which the field tells the surface.
    """
    near_m, reach_m = (float(np.nanquantile(view.depth_m, share)) for share in (_NEAR_SHARE, _FAR_SHARE))
    noise_m = view.noise_per_m * near_m**2
    far_noise_m = view.noise_per_m * reach_m**2 if near_m >= STREET_NEAR_M else 0.0
    if math.isnan(voxel_m):
        deserved_m = max(noise_m / 2, far_noise_m / _TRUNCATION_VOXELS)
        voxel_m = _rounded(min(max(deserved_m, _LEAST_VOXEL_M), _MOST_VOXEL_M))
    wide = max(_TRUNCATION_VOXELS, _SIGMAS * noise_m / voxel_m, far_noise_m / voxel_m)
    truncation = min(wide, _MOST_TRUNCATION_VOXELS)
    far_m = max(math.sqrt(truncation * voxel_m / view.noise_per_m), near_m)
    return VolumeSettings(
        voxel_m=voxel_m,
        far_m=far_m,
        most_bytes=most_bytes,
        truncation_voxels=truncation,
        near_m=near_m,
        noise_per_m=view.noise_per_m,
    )


def thinner(settings: VolumeSettings, share: float) -> VolumeSettings:
    """Return settings of a field that tells the surface over a share of the distance: for a thing whose poses need no wide bridge, and that would be fattened."""
    return replace(settings, truncation_voxels=share * settings.truncation_voxels)


def _rounded(length_m: float) -> float:
    """Round to one of 20 lengths a decade: 1, 1.1, 1.3, 1.4 ... so that alike rigs give alike models."""
    step = round(math.log10(length_m) * _STEPS_PER_TEN)
    return float(f"{10 ** (step / _STEPS_PER_TEN):.2g}")
