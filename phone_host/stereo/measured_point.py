"""Points in space, measured from two images, with what is known of their uncertainty. Pure.

A point of the left image is a ray, exact by definition: the user means that pixel. The right image's ray is uncertain
by the match's covariance. Both are intersected (`geometry.triangulate`). Three parts make the uncertainty:

- noise of both images, as `point_match` finds it in them;
- if the two rays miss each other by more than that explains, the noise is larger than it seems: its standard deviation
  is multiplied by how many times more (R. T. Birge, "The calculation of errors by the method of least squares", 1932, as
  the Particle Data Group does it);
- the rig's zero: the uncertainty of the disparity of infinitely far points, which is common to all points of the image.

Distances from the camera are Gaussian in their inverse, because disparity is, so their limits lie unevenly.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.geometry.triangulate import point_jacobian, triangulate
from phone_host.model import Epipolar, StereoGeometry
from phone_host.stereo.between_pixels import Floats
from phone_host.stereo.point_match import PointMatch

SIGMAS_95: Final = 1.959964
"""95 % of a Gaussian lie within so many standard deviations."""

_EXACT_PX: Final = 1e-4
"""Standard deviation of the left ray, which is exact: small beside any match, large beside rounding."""

_BEHIND: Final = {Epipolar.LEFT: (-1.0, 0.0, 0.0), Epipolar.UP: (0.0, -1.0, 0.0), Epipolar.DOWN: (0.0, 1.0, 0.0)}
"""Where the left camera stands in the right one's rectified axes, in baselines."""


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
        zero_m: (3,) float64 how the point moves if the rig's zero is off by one standard deviation; 0 if that is not known.
        distance: from the left camera's centre.
        miss_px: how far the two rays miss each other, px of the rectified images.
        noise_factor: by how much the images' noise was taken to be larger than it seems, >= 1.
    """

    point_m: Floats
    covariance_m2: Floats
    zero_m: Floats
    distance: Within
    miss_px: float
    noise_factor: float


def measured_point(
    left_px: tuple[float, float],
    match: PointMatch,
    geometry: StereoGeometry,
    epipolar: Epipolar = Epipolar.LEFT,
    zero_sigma_px: float = math.nan,
) -> MeasuredPoint:
    """Intersect the rays of a point.

    Args:
        left_px: x and y in the rectified left image, px.
        match: where it lies in the right one.
        geometry: of the rectified pair.
        epipolar: which way its epipolar lines run.
        zero_sigma_px: standard uncertainty of the disparity of infinitely far points, px; NaN: not known.
    """
    focal_px, principal = geometry.focal_px, np.array([geometry.cx_px, geometry.cy_px])
    right_principal = principal + np.array([0.0 if epipolar.is_vertical else geometry.doffs_px, 0.0])
    step = np.array(_BEHIND[epipolar][:2]) * (0.0 if math.isnan(zero_sigma_px) else zero_sigma_px)
    pose = SE3(np.eye(3), np.array(_BEHIND[epipolar]) * geometry.baseline_m)
    # The second point is that of a rig whose zero is off by one standard deviation.
    left = np.repeat((np.array([left_px]) - principal) / focal_px, 2, axis=0)
    right = (np.stack([match.right_px, match.right_px + step]) - right_principal) / focal_px
    noise = np.stack([np.eye(2) * _EXACT_PX**2, match.covariance_px2]) / focal_px**2
    found = triangulate(np.stack([left, right]), np.stack([noise] * 2, axis=1), [SE3.identity(), pose])
    q, zero_q = found.parameters[0], found.parameters[1] - found.parameters[0]
    # Two rays have one degree of freedom: chi2 is 1 on average where the noise is as stated.
    factor = max(1.0, math.sqrt(float(found.chi2[0])))
    covariance = found.parameter_covariance[0] * factor**2
    spread = point_jacobian(q[None])[0]
    return MeasuredPoint(
        point_m=found.points_m[0],
        covariance_m2=spread @ covariance @ spread.T,
        zero_m=spread @ zero_q,
        distance=_distance(q, covariance, zero_q),
        miss_px=abs(match.across_px),
        noise_factor=factor,
    )


def _distance(q: Floats, covariance: Floats, zero_q: Floats) -> Within:
    """Return the distance and its limits: its inverse w / |(a, b, 1)| is Gaussian."""
    a, b, w = q
    length = math.sqrt(a * a + b * b + 1)
    gradient = np.array([-w * a / length**3, -w * b / length**3, 1 / length])
    sigma = math.sqrt(float(gradient @ covariance @ gradient) + float(gradient @ zero_q) ** 2)
    inverse = w / length
    value, low, high = (
        1 / each if each > 0 else math.inf
        for each in (inverse, inverse + SIGMAS_95 * sigma, inverse - SIGMAS_95 * sigma)
    )
    return Within(value, low, high)


def distance_between(one: MeasuredPoint, other: MeasuredPoint) -> Within:
    """Return the distance of two points of one pair of images, and its limits.

    The noise of both is independent; the rig's zero moves both together.

    Args:
        one: a point.
        other: another one.
    """
    apart = one.point_m - other.point_m
    length_m = float(np.linalg.norm(apart))
    common_m = one.zero_m - other.zero_m
    covariance = one.covariance_m2 + other.covariance_m2 + np.outer(common_m, common_m)
    if length_m > 0:
        variance = float(apart @ covariance @ apart) / length_m**2
    else:  # the same place: it may be off in any direction
        variance = float(np.linalg.eigvalsh(covariance)[-1])
    reach_m = SIGMAS_95 * math.sqrt(variance)
    return Within(length_m, max(length_m - reach_m, 0.0), length_m + reach_m)
