"""The types that the host's stages pass to each other. No behaviour, no I/O.

Conventions: camera axes x right, y down, z forward; pixel centres are integers (OpenCV); metres inside; NaN = no
    measurement.
"""

from phone_host.model.evidence import (
    AS_CALIBRATED,
    Arrangement,
    Change,
    ChangeKind,
    Departure,
    Drift,
    DriftState,
    Evidence,
    Exposure,
    OffMiddle,
    Support,
    Trend,
    Turn,
)
from phone_host.model.images import (
    CloudImage,
    Confidence,
    Crop,
    CutCounts,
    DepthLimits,
    Disparity,
    Epipolar,
    Image,
    Matched,
    MatchReport,
    RectifiedPair,
    Search,
    StereoGeometry,
)
from phone_host.model.quality import DisparityPlane, PlaneQuality, Seen, Tiles, UnseenSurface
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
    BudgetAccount,
    BudgetChange,
    BudgetReason,
    BudgetStep,
    DepthAccount,
    FramePair,
    PairCounts,
    Processed,
    Result,
    Unwritten,
)
