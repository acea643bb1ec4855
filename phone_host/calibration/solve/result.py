"""The result of a calibration, and how good it is for views that it has not seen. Values only. Pure."""

from dataclasses import dataclass, field

import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.solve.next_view import NextView
from phone_host.calibration.target.pairs import Rejected
from phone_host.model import CameraModel, Rectification, Rig
from phone_host.model.calibration_series import BoardInSpace


@dataclass(frozen=True, slots=True, eq=False)
class LensTrial:
    """How one formula did.

    Attributes:
        bend: the formula.
        model: the camera fitted to all views.
        held_out_px: (V,) root mean square error of each view, predicted by a camera that has not seen it, px.
        fitted_px: (V,) the same by the camera fitted to all views.
    """

    bend: Bend
    model: CameraModel
    held_out_px: Vector
    fitted_px: Vector

    @property
    def rms_px(self) -> float:
        """Root mean square over the views, px."""
        return float(np.sqrt((self.held_out_px**2).mean()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Squares:
    """How large the squares of boards came out.

    Attributes:
        true_m: side of a square, m.
        mean_m: mean of those measured, m; NaN: not measured.
        sigma_m: their standard deviation, m.
        count: their number.
    """

    true_m: float
    mean_m: float
    sigma_m: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Used:
    """A pair that is used, and how well it fits.

    Attributes:
        name: the pair.
        left_px: root mean square reprojection error in the left image, px.
        right_px: the same, right.
        vertical_px: root mean square vertical error after rectification, px; NaN when the rig cannot be rectified.
        in_space: the board as the rig sees it.
    """

    name: str
    left_px: float
    right_px: float
    vertical_px: float
    in_space: BoardInSpace


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The result of a calibration.

    Attributes:
        rig: the two cameras.
        rectification: of the rig; None when the rig cannot be rectified (see `obstacle`).
        obstacle: why it cannot be rectified, and the remedy.
        used: pairs used.
        rejected: pairs that the calibration rejected.
        vertical_px: (M,) absolute vertical error of every corner used, after rectification.
        baseline_sigma_m: standard deviation of the baseline that the corners' noise leaves, m.
        tilts_deg: (V,) angle between each board and the image plane.
        spread: share of the image's width and height that the corners span, the smaller over both cameras.
        bends: which coefficients were estimated for the left and for the right camera.
        squares: how large the squares of boards came out that the rig had not seen.
        depths: depth and the standard uncertainty that the calibration leaves there, m, for some depths.
        advice: which view would teach most; None: it cannot be told.
        trials: how the formulas of the left and of the right lens did that were tried.
        poses: (V, 6) of the boards of the pairs used, in the left camera's axes.
        left_errors_px: (V, N, 2) of the pairs used, measured minus projected; NaN where a corner was not seen.
        right_errors_px: (V, N, 2), the same, right.
    """

    rig: Rig
    rectification: Rectification | None
    obstacle: DataError | None
    used: tuple[Used, ...]
    rejected: tuple[Rejected, ...]
    vertical_px: Vector
    baseline_sigma_m: float
    tilts_deg: Vector
    spread: float
    bends: tuple[Bend, Bend]
    squares: Squares
    depths: tuple[tuple[float, float], ...] = ()
    advice: NextView | None = None
    trials: tuple[tuple[LensTrial, ...], tuple[LensTrial, ...]] = ((), ())
    poses: Vector = field(default_factory=lambda: np.empty((0, 6)))
    left_errors_px: Vector = field(default_factory=lambda: np.empty((0, 0, 2)))
    right_errors_px: Vector = field(default_factory=lambda: np.empty((0, 0, 2)))
