"""The types that the host's stages pass to each other. No behaviour, no I/O.

Conventions: camera axes x right, y down, z forward; pixel centres are integers (OpenCV); metres inside; NaN = no
    measurement.
"""

from phone_host.model.budget import BudgetAccount, BudgetChange, BudgetReason, BudgetStep
from phone_host.model.drift import (
    AS_CALIBRATED,
    Change,
    ChangeKind,
    Departure,
    Drift,
    DriftState,
    Trend,
    Turn,
)
from phone_host.model.evidence import (
    Arrangement,
    Evidence,
    Exposure,
    OffMiddle,
    Support,
)
from phone_host.model.images import (
    CloudImage,
    Crop,
    CutCounts,
    DepthLimits,
    Disparity,
    Epipolar,
    Image,
    RectifiedPair,
    Search,
    StereoGeometry,
)
from phone_host.model.matching import (
    Confidence,
    Matched,
    MatchReport,
)
from phone_host.model.quality import DisparityPlane, PlaneQuality, Seen, Tiles
from phone_host.model.rig import (
    RIG_PARAMETERS,
    UNMEASURED_NS,
    CameraModel,
    Lens,
    Rectification,
    Rig,
    Side,
    TimeOffset,
    Verdict,
)
from phone_host.model.run import (
    BoardFrame,
    DepthAccount,
    FramePair,
    PairCounts,
    Processed,
    Result,
    Unwritten,
)

__all__ = [
    "AS_CALIBRATED",
    "RIG_PARAMETERS",
    "UNMEASURED_NS",
    "Arrangement",
    "BoardFrame",
    "BudgetAccount",
    "BudgetChange",
    "BudgetReason",
    "BudgetStep",
    "CameraModel",
    "Change",
    "ChangeKind",
    "CloudImage",
    "Confidence",
    "Crop",
    "CutCounts",
    "Departure",
    "DepthAccount",
    "DepthLimits",
    "Disparity",
    "DisparityPlane",
    "Drift",
    "DriftState",
    "Epipolar",
    "Evidence",
    "Exposure",
    "FramePair",
    "Image",
    "Lens",
    "MatchReport",
    "Matched",
    "OffMiddle",
    "PairCounts",
    "PlaneQuality",
    "Processed",
    "Rectification",
    "RectifiedPair",
    "Result",
    "Rig",
    "Search",
    "Seen",
    "Side",
    "StereoGeometry",
    "Support",
    "Tiles",
    "TimeOffset",
    "Trend",
    "Turn",
    "Unwritten",
    "Verdict",
]
