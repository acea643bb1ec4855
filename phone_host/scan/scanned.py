"""What a scan tells: what became of a pair, and what it has learnt since its last submap. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.carving import Carved
from phone_host.scan.mat_pose import MatSaid
from phone_host.scan.tracker import TrackerState
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.volume import BlockValues
from phone_host.scan.volume_settings import VolumeSettings


class PoseOrigin(Enum):
    """What tells the pose of a pair.

    MODEL: the pair is fused. ODOMETRY: it is tracked, but not fused. NONE: it is lost, and its pose is not known.
    """

    MODEL = "fused"
    ODOMETRY = "tracked only"
    NONE = "lost"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScannedPair:
    """What became of a pair.

    Attributes:
        name: of the pair.
        stamp_s: when it was taken, s, from any beginning; its number where nobody knows.
        world_camera: where the rectified left camera was; where it is lost, as far as odometry tells.
        state: how sure that is.
        weakness: why it is not surer.
        density: share of the pixels that have a depth, 0..1.
        corners: that agree on the motion since the last pair; 0 for the first.
        overlap: share of its depths that lie on the model, 0..1; NaN: not compared.
        off_m: mean distance of these from the model, m; NaN: not compared.
        mat: what the mat told; None: it was not seen, or nobody looked for it.
        is_followed: whether odometry tells the pose of a pair that is not fused, without a gap since one that is.
    """

    name: str
    stamp_s: float
    world_camera: SE3
    state: Tracking
    weakness: Weakness
    density: float
    corners: int = 0
    overlap: float = math.nan
    off_m: float = math.nan
    mat: MatSaid | None = None
    is_followed: bool = False

    @property
    def is_fused(self) -> bool:
        """Whether it became part of the model."""
        return self.state is not Tracking.LOST

    @property
    def pose_origin(self) -> PoseOrigin:
        """What tells its pose."""
        if self.is_fused:
            return PoseOrigin.MODEL
        return PoseOrigin.ODOMETRY if self.is_followed else PoseOrigin.NONE


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Submap:
    """What a scan has learnt since its last submap was closed; all of them together are the scan.

    Attributes:
        is_whole: whether it holds everything since the beginning; what was closed before is not needed any more.
        pairs: since then, in order.
        settings: of the model.
        geometry: of the pairs.
        size_px: width and height of their rectified images.
        blocks: those that got something since then, with all that they hold.
        tracker: where it stood at the end, and the places since then.
        carved: what all views since the beginning told of the box; None: there is none.
    """

    is_whole: bool
    pairs: tuple[ScannedPair, ...]
    settings: VolumeSettings
    geometry: StereoGeometry
    size_px: tuple[int, int]
    blocks: BlockValues
    tracker: TrackerState
    carved: Carved | None = None


def begun_on_table(submaps: Sequence[Submap]) -> bool:
    """Return whether submaps are of a thing on a table: then the first pair is not taken in the origin, though no mat told where it was."""
    first = next((pair for submap in submaps for pair in submap.pairs if pair.is_fused), None)
    return first is not None and first.mat is None and bool(first.world_camera.t_m.any())
