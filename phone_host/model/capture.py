"""What a check of a camera's images found: values only. `doctor.camera_check` computes them."""

import math
from dataclasses import dataclass
from enum import Enum

from common.camera_identity import UNKNOWN_CAMERA, CameraIdentity


class Warping(Enum):
    """Whether a camera's software warps its images.

    GOOD: they are those of one rigid camera. STABILISED: they are not. UNKNOWN: too little was seen to tell.
    """

    GOOD = "good"
    STABILISED = "stabilised"
    UNKNOWN = "cannot tell"


class Unseen(Enum):
    """Why some frames do not tell whether they were warped.

    STILL: the picture moved too little. PLAIN: too few details. FLAT: a wall or a poster, whose film fits many cameras. LIVELY: too much in the picture moves on its own. VAGUE: neither clearly rigid nor clearly
    warped.
    """

    STILL = "still"
    PLAIN = "plain"
    FLAT = "flat"
    LIVELY = "lively"
    VAGUE = "vague"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How frames came.

    Attributes:
        frames: how many.
        seconds: from the first stamp to the last, s.
        asked_hz: rate that was asked for; NaN: none was.
        rate_hz: frames per second, all in all; NaN: fewer than two came.
        usual_hz: by the median interval, which gaps do not change.
        first_hz: rate of the first quarter.
        last_hz: rate of the last quarter.
        missing: frames that are missing between others, by the gaps in the stamps.
        backwards: stamps that are not later than the one before.
        jitter_ms: 95 % of the stamps lie no farther than this from an even beat through their neighbours.
        delay_ms: from stamp to arrival, median; NaN: unknown.
        delay_jitter_ms: by how much later than the fastest 95 % of the frames arrive.
        first_delay_ms: median of the first quarter.
        last_delay_ms: median of the last quarter.
        exposure_ms: median; NaN: the camera does not say.
        longest_exposure_ms: the longest one.
        brightness: mean grey level, 0 to 255.
    """

    frames: int = 0
    seconds: float = 0.0
    asked_hz: float = math.nan
    rate_hz: float = math.nan
    usual_hz: float = math.nan
    first_hz: float = math.nan
    last_hz: float = math.nan
    missing: int = 0
    backwards: int = 0
    jitter_ms: float = math.nan
    delay_ms: float = math.nan
    delay_jitter_ms: float = math.nan
    first_delay_ms: float = math.nan
    last_delay_ms: float = math.nan
    exposure_ms: float = math.nan
    longest_exposure_ms: float = math.nan
    brightness: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Rigidity:
    """Whether the images move as those of one rigid camera.

    Attributes:
        warping: the verdict.
        unseen: why it cannot be told; None where it can.
        windows: stretches of film that tell something.
        warped: how many of them no rigid camera can have made.
        excess: by how much a warp of each frame explains more than noise, in standard deviations of the noise; median.
        noise_px: by how much followed points scatter about the best warp, px; median.
        knows_lens: whether the calibrated lens was used.
        readout_ms: from the first row to the last, rolling shutter; NaN: not told. Of stabilised images it is told only where it is the reason.
        readout_sigma_ms: its standard uncertainty.
    """

    warping: Warping = Warping.UNKNOWN
    unseen: Unseen | None = Unseen.STILL
    windows: int = 0
    warped: int = 0
    excess: float = math.nan
    noise_px: float = math.nan
    knows_lens: bool = False
    readout_ms: float = math.nan
    readout_sigma_ms: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureSource:
    """Whose images were checked. A check holds for no other.

    Attributes:
        camera: which camera.
        software: what made the images of it, such as a browser; empty: the camera itself.
        width_px: of its images, px.
        height_px: of its images, px.
    """

    camera: CameraIdentity = UNKNOWN_CAMERA
    software: str = ""
    width_px: int
    height_px: int

    @property
    def is_of_phone(self) -> bool:
        """Whether the software is that of a phone or tablet: its sensor is read row by row."""
        return any(name in self.software for name in ("Android", "iPhone", "iPad"))


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureReport:
    """What a check found.

    Attributes:
        source: whose images.
        pace: how they came.
        rigidity: how they moved.
    """

    source: CaptureSource
    pace: Pace
    rigidity: Rigidity
