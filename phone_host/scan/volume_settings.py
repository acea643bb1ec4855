"""How fine a volume is, how far it sees, and how much memory it may take. Pure."""

from dataclasses import dataclass, replace
from typing import Final

from phone_host.scan.blocks import BLOCK_BYTES

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
