"""Points in space, measured from two images, with what is known of their uncertainty. Pure.

A point of the left image is a ray, exact by definition: the user means that pixel. The right image's ray is uncertain
by the match's covariance. Both are intersected (`geometry.triangulate`). Three parts make the uncertainty:

- noise of both images, as `point_match` finds it in them;
- if the two rays miss each other by more than that explains, the noise is larger than it seems: its standard deviation
  is multiplied by how many times more (R. T. Birge, "The calculation of errors by the method of least squares", 1932, as
  the Particle Data Group does it);
- the rig's own uncertainty, which is common to all points of the image (`rig_errors`).

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
from phone_host.stereo.rig_errors import BEHIND, RigErrors, ZeroError

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
    rig: RigErrors = ZeroError(),  # noqa: B008  # frozen
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
    behind = np.array(BEHIND[epipolar])
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
