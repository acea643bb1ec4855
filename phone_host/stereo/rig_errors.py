"""What a rig's own uncertainty does to the pixels of one point. Pure.

It is given as independent errors, each of one standard deviation, which are common to all points of a pair: so each moves two
points together, and their distance less than either. A rig that was solved here has the covariance of all its parameters; an
older file may have its zero alone, the uncertainty of the disparity of infinitely far points.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from phone_host.geometry.lens import pixel_derivatives, standard_errors
from phone_host.model import Epipolar, Rectification, Rig
from phone_host.stereo.between_pixels import Floats

BEHIND: Final = {Epipolar.LEFT: (-1.0, 0.0, 0.0), Epipolar.UP: (0.0, -1.0, 0.0), Epipolar.DOWN: (0.0, 1.0, 0.0)}
"""Where the left camera stands in the right one's rectified axes, in baselines."""


class Known(Enum):
    """What is known of a rig's uncertainty."""

    ALL = "covariance"
    ZERO = "zero"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class ZeroError:
    """Only the rig's zero is known, or not even that.

    Attributes:
        sigma_px: standard uncertainty of the disparity of infinitely far points, px; NaN: not known.
        epipolar: which way the epipolar lines run.
    """

    sigma_px: float = math.nan
    epipolar: Epipolar = Epipolar.LEFT

    @property
    def known(self) -> Known:
        """What is known."""
        return Known.NOTHING if math.isnan(self.sigma_px) else Known.ZERO

    def pixels(self, slopes: Floats, nearness: float) -> Floats:  # noqa: ARG002  # the same everywhere
        """Return how the pixels of a point move by each error, (1 or 0, 2, 2) px; see `ParameterErrors`."""
        if math.isnan(self.sigma_px):
            return np.zeros((0, 2, 2))
        return np.array([[(0.0, 0.0), BEHIND[self.epipolar][:2]]]) * self.sigma_px


class ParameterErrors:
    """The covariance of all parameters is known."""

    known: Final = Known.ALL

    def __init__(self, rig: Rig, rectification: Rectification) -> None:
        self._rig, self._rectification = rig, rectification
        self._errors = standard_errors(rig.covariance)

    def pixels(self, slopes: Floats, nearness: float) -> Floats:
        """Return how the rectified pixels of a point move by each error.

        Args:
            slopes: (2,) x / z and y / z of the point in the left camera's rectified axes.
            nearness: 1 / z, 1/m.

        Returns:
            (30, 2, 2): of each error, in the left and in the right image, x and y, px.
        """
        [by_parameter] = pixel_derivatives(slopes[np.newaxis], np.array([nearness]), self._rig, self._rectification)
        return np.asarray(np.moveaxis(by_parameter @ self._errors, -1, 0), np.float64)


RigErrors = ZeroError | ParameterErrors


def rig_errors(rig: Rig, rectification: Rectification) -> RigErrors:
    """Return what is known of a rig's uncertainty: of all parameters, else of its zero."""
    if np.isfinite(rig.covariance).all():
        return ParameterErrors(rig, rectification)
    return ZeroError(rig.zero_sigma_px, rectification.epipolar)
