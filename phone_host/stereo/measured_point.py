"""Points in space, measured from two images, with what is known of their uncertainty. Pure.

A point of the left image is a ray, exact by definition: the user means that pixel. The right image's ray is uncertain
by the match's covariance. Both are intersected (`geometry.triangulate`). Three parts make the uncertainty:

- noise of both images, as `point_match` finds it in them;
- if the two rays miss each other by more than that explains, the noise is larger than it seems: its standard deviation
  is multiplied by how many times more (R. T. Birge, "The calculation of errors by the method of least squares", 1932, as
  the Particle Data Group does it);
- the rig's own uncertainty, as independent errors of one standard deviation each, which are common to all points of a pair:
  each moves two points together, and their distance less than either. A rig that was solved here has the covariance of all
  its parameters; an older file may have its zero alone, the uncertainty of the disparity of infinitely far points.

Distances from the camera are Gaussian in their inverse, because disparity is, so their limits lie unevenly.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from phone_host.geometry.lens import pixel_derivatives, standard_errors
from phone_host.geometry.se3 import SE3
from phone_host.geometry.triangulate import point_jacobian, triangulate
from phone_host.model import Epipolar, Rectification, Rig, StereoGeometry
from phone_host.stereo.point_match import PointMatch
from phone_host.stereo.point_window import HALF_PX, Floats

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
        return np.array([[(0.0, 0.0), self.epipolar.way]]) * self.sigma_px


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


SIGMAS_95: Final = 1.959964
"""95 % of a Gaussian lie within so many standard deviations."""

_EXACT_PX: Final = 1e-4
"""Standard deviation of the left ray, which is exact: small beside any match, large beside rounding."""


@dataclass(frozen=True, slots=True)
class Within:
    """A length and the limits between which it lies in 95 % of cases, m.

    Attributes:
        value_m: the best estimate.
        low_m: the lower limit.
        high_m: the upper limit; infinite where it cannot be told from infinity.
    """

    value_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPoint:
    """A point in space.

    Attributes:
        point_m: (3,) float64 in the left camera's rectified axes (those of cloud.ply), m; NaN: not before infinity.
        covariance_m2: (3, 3) float64 by the noise of both images, m^2.
        rig_m: (K, 3) float64 how the point moves by each of the rig's K independent errors of one standard deviation; K is 0 if
            nothing is known of them.
        distance: from the left camera's centre.
        miss_px: how far the two rays miss each other, px of the rectified images.
        noise_factor: by how much the images' noise was taken to be larger than it seems, >= 1.
    """

    point_m: Floats
    covariance_m2: Floats
    rig_m: Floats
    distance: Within
    miss_px: float
    noise_factor: float


def measured_point(
    left_px: tuple[float, float],
    match: PointMatch,
    geometry: StereoGeometry,
    epipolar: Epipolar = Epipolar.LEFT,
    rig: RigErrors = ZeroError(),  # frozen
) -> MeasuredPoint:
    """Intersect the rays of a point.

    Args:
        left_px: x and y in the rectified left image, px.
        match: where it lies in the right one.
        geometry: of the rectified pair.
        epipolar: which way its epipolar lines run.
        rig: what is known of the rig's own uncertainty.
    """
    focal_px, principal = geometry.focal_px, np.array([geometry.cx_px, geometry.cy_px])
    right_principal = principal + np.array([0.0 if epipolar.is_vertical else geometry.doffs_px, 0.0])
    behind = np.array([*epipolar.way, 0.0])
    poses = [SE3.identity(), SE3(np.eye(3), behind * geometry.baseline_m)]
    rays = np.stack([np.array([left_px]) - principal, match.right_px[np.newaxis] - right_principal]) / focal_px
    noise = np.stack([np.eye(2) * _EXACT_PX**2, match.covariance_px2]) / focal_px**2
    found = triangulate(rays, noise[:, np.newaxis], poses)
    q = found.parameters[0]
    moved_px = rig.pixels(q[:2], float(q[2]))
    apart_px = moved_px[:, 1] - moved_px[:, 0]
    # The least squares of one ray that is exact: nearness is the shift along the line, corrected by what the miss across it tells.
    along = np.linalg.solve(match.covariance_px2, behind[:2])
    by_shift = along / (along @ behind[:2]) / geometry.baseline_m
    rig_q = np.column_stack([moved_px[:, 0], apart_px @ by_shift]) / focal_px
    # Two rays have one degree of freedom: chi2 is 1 on average where the noise is as stated. The rig's rows have their share in it.
    across = 0 if epipolar.is_vertical else 1
    rows_px2 = float(np.square(apart_px[:, across]).sum())
    noise_px2 = float(match.covariance_px2[across, across])
    factor = max(1.0, math.sqrt(float(found.chi2[0]) * noise_px2 / (noise_px2 + rows_px2)))
    covariance = found.parameter_covariance[0] * factor**2
    spread = point_jacobian(q[None])[0]
    return MeasuredPoint(
        point_m=found.points_m[0],
        covariance_m2=spread @ covariance @ spread.T,
        rig_m=rig_q @ spread.T,
        distance=_distance(q, covariance, rig_q),
        miss_px=abs(match.across_px),
        noise_factor=factor,
    )


def _distance(q: Floats, covariance: Floats, rig_q: Floats) -> Within:
    """Return the distance and its limits: its inverse w / |(a, b, 1)| is Gaussian."""
    a, b, w = q
    length = math.sqrt(a * a + b * b + 1)
    gradient = np.array([-w * a / length**3, -w * b / length**3, 1 / length])
    sigma = math.sqrt(float(gradient @ covariance @ gradient) + float(np.square(rig_q @ gradient).sum()))
    inverse = w / length
    value, low, high = (
        1 / each if each > 0 else math.inf
        for each in (inverse, inverse + SIGMAS_95 * sigma, inverse - SIGMAS_95 * sigma)
    )
    return Within(value, low, high)


def distance_between(one: MeasuredPoint, other: MeasuredPoint) -> Within:
    """Return the distance of two points of one pair of images, and its limits.

    The noise of both is independent; the rig's errors move both together.
    """
    apart = one.point_m - other.point_m
    length_m = float(np.linalg.norm(apart))
    common_m = one.rig_m - other.rig_m
    covariance = one.covariance_m2 + other.covariance_m2 + common_m.T @ common_m
    if length_m > 0:
        variance = float(apart @ covariance @ apart) / length_m**2
    else:  # the same place: it may be off in any direction
        variance = float(np.linalg.eigvalsh(covariance)[-1])
    reach_m = SIGMAS_95 * math.sqrt(variance)
    return Within(length_m, max(length_m - reach_m, 0.0), length_m + reach_m)


_WIDE: Final = 0.02
"""Half of the distance between the limits, as a share of the distance itself: nobody asks why below."""

_MISSED: Final = 2.0
"""Rays that miss each other by so many times the noise have another reason than noise."""

_USUAL_PX: Final = 0.1
"""A match on good texture is surer; median of the rendered rooms of bench_measure: 0.05 px."""

_FEW_SHARE: Final = 0.5


class Wide(Enum):
    """Why limits lie far apart; the value says it to the user."""

    RIG = "the rig's calibration is uncertain: calibrate with more pictures"
    MISSED = "its two rays miss each other: the rig or the object moved, or this is another point"
    NEIGHBOURS = "few pixels around it lie on the same surface"
    TEXTURE = "there is little texture around it"
    FAR = "it is far away for this baseline"


def why_wide(point: MeasuredPoint, match: PointMatch, epipolar: Epipolar = Epipolar.LEFT) -> Wide | None:
    """Return why a point's limits are wide; None if they are not.

    Args:
        point: as measured, before infinity.
        match: from which it was.
        epipolar: which way its epipolar lines run.
    """
    length = point.distance
    if length.high_m - length.low_m <= 2 * _WIDE * length.value_m:
        return None
    if float(np.square(point.rig_m[:, 2]).sum()) > point.covariance_m2[2, 2]:
        return Wide.RIG
    if point.noise_factor > _MISSED:
        return Wide.MISSED
    along = int(epipolar.is_vertical)
    if math.sqrt(match.covariance_px2[along, along]) <= _USUAL_PX:
        return Wide.FAR
    few = match.pixels < _FEW_SHARE * (2 * HALF_PX + 1) ** 2
    return Wide.NEIGHBOURS if few else Wide.TEXTURE
