"""Two calibrated cameras, and how their images are rectified. No behaviour, no I/O."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.camera_identity import RememberedCamera
from phone_host.model.images import Epipolar, StereoGeometry


class Side(Enum):
    """One of the two views. The left camera is the reference: the pixels of its image get a depth."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def other(self) -> "Side":
        """The opposite side."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT


RIG_PARAMETERS: Final = 30
"""Twelve of each camera, six of their relative pose; see `Rig.covariance`."""


class Verdict(Enum):
    """What a calibration is good for."""

    GOOD = "good"
    USABLE = "usable"
    REJECT = "reject"


class Lens(Enum):
    """Which formula bends the rays of a camera; `geometry.lens` has them."""

    PINHOLE = "pinhole"
    RATIONAL = "rational"
    FISHEYE = "fisheye"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CameraModel:
    """How one camera projects: a lens of OpenCV's, with its coefficients.

    The device itself is `common.camera.base.Camera`.

    Attributes:
        width_px: image width, px.
        height_px: image height, px.
        matrix: (3, 3) float64 camera matrix K, px.
        distortion: (N,) float64 coefficients as OpenCV takes them. Pinhole: k1 k2 p1 p2 [k3]; rational: k1 k2 p1 p2 k3 k4 k5
            k6 [s1 ... s4 [tx ty]]; fisheye: k1 k2 k3 k4 of the angle.
        lens: what the coefficients mean. Pinhole with eight or more coefficients counts as rational.
    """

    width_px: int
    height_px: int
    matrix: NDArray[np.float64]
    distortion: NDArray[np.float64]
    lens: Lens = Lens.PINHOLE

    @property
    def mean_focal_px(self) -> float:
        """The mean of both focal lengths, px: how fine its pixels are."""
        return float(self.matrix[0, 0] + self.matrix[1, 1]) / 2


UNMEASURED_NS: Final = 16_700_000
"""Assumed limit of the time offset until it is measured: one readout, taken as half the period of 30 frames/s."""


@dataclass(frozen=True, slots=True)
class TimeOffset:
    """The host camera's stamp minus the board camera's stamp for the same moment, both on the host's clock.

    Attributes:
        offset_ns: added to the board's stamps before frames are paired.
        uncertainty_ns: half-width around `offset_ns` that contains the true value in 99.9 % of cases.
    """

    offset_ns: int = 0
    uncertainty_ns: int = UNMEASURED_NS


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rig:
    """Two calibrated cameras, possibly of different image size, and their relative pose.

    A point p_left in the left camera's axes is p_right = R_right_left @ p_left + t_right_left_m in the right camera's
    (OpenCV's R and T of stereoCalibrate).

    Attributes:
        left: model of the reference camera.
        right: model of the other camera.
        R_right_left: (3, 3) float64 rotation.
        t_right_left_m: (3,) float64 translation, m; its x is negative when the right camera is on the right.
        board_side: which of the two is the board's camera.
        rms_left_px: reprojection RMS of the left camera alone, px; NaN = not measured.
        rms_right_px: the same for the right camera.
        rms_stereo_px: reprojection RMS of the stereo calibration, px; NaN = not measured.
        time_offset: time offset between the two cameras' stamps.
        zero_sigma_px: standard uncertainty of the disparity of infinitely far points, px, at the size of the rig's
            images; NaN = not measured.
        verdict: how the calibration judged itself; None: not stated.
        left_camera: which camera the left one was, and how it was set; None: not stated.
        right_camera: the same for the right one.
        covariance: (30, 30) float64 of the parameters: fx fy cx cy and eight coefficients of the left camera (in the order of
            `geometry.lens`), the same of the right one, a small turn of the right camera about its own axes (rad), the translation
            (m); 0 for those that were not estimated, NaN = not measured.
        is_cropped: whether images are taken for the middle of those of the calibration, cut px by px.
    """

    left: CameraModel
    right: CameraModel
    R_right_left: NDArray[np.float64]
    t_right_left_m: NDArray[np.float64]
    board_side: Side = Side.LEFT
    rms_left_px: float = float("nan")
    rms_right_px: float = float("nan")
    rms_stereo_px: float = float("nan")
    time_offset: TimeOffset = TimeOffset()
    zero_sigma_px: float = float("nan")
    verdict: Verdict | None = None
    left_camera: RememberedCamera | None = None
    right_camera: RememberedCamera | None = None
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.full((RIG_PARAMETERS, RIG_PARAMETERS), np.nan))
    is_cropped: bool = False

    @property
    def is_rejected(self) -> bool:
        """Whether its own calibration found it unfit."""
        return self.verdict is Verdict.REJECT

    @property
    def baseline_sigma_m(self) -> float:
        """Standard uncertainty of the baseline, m; NaN = not measured."""
        direction = self.t_right_left_m / np.linalg.norm(self.t_right_left_m)
        return float(np.sqrt(np.maximum(direction @ self.covariance[-3:, -3:] @ direction, 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Rectification:
    """How both images are rotated and cropped. `rig.yaml` holds these values beside the rig itself.

    Attributes:
        geometry: converts disparity to metres; its axes are those of the *rectified* left camera.
        width_px: width of both rectified images, px.
        height_px: height of both rectified images, px.
        R_left: (3, 3) float64, takes the left camera's axes to the rectified ones (OpenCV's R1).
        R_right: (3, 3) float64, the same for the right camera (R2).
        P_left: (3, 4) float64 projection of rectified points into the left rectified image (P1).
        P_right: (3, 4) float64, the same for the right rectified image (P2), metres.
        Q: (4, 4) float64, maps (u, v, d, 1) to homogeneous metres; d >= 0 also if the cameras stand one above the other.
        epipolar: which way the epipolar lines of the rectified images run.
    """

    geometry: StereoGeometry
    width_px: int
    height_px: int
    R_left: NDArray[np.float64]
    R_right: NDArray[np.float64]
    P_left: NDArray[np.float64]
    P_right: NDArray[np.float64]
    Q: NDArray[np.float64]
    epipolar: Epipolar = Epipolar.LEFT
