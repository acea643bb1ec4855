"""How good a fit is for views that it has not seen. Values only. Pure."""

from dataclasses import dataclass

import numpy as np

from phone_host.calibration.bend import Bend
from phone_host.calibration.bundle import Vector
from phone_host.model import CameraModel


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
