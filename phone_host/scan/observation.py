"""Points as a rectified pair sees them: (u, v, d), their noise, and how they change with the camera's motion. Pure.

u and v come from following a corner, d from the matcher, so their errors are independent. Without a disparity d is NaN and counts nothing.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import StereoGeometry

Floats = NDArray[np.float64]

FOLLOWING_PX: Final = 0.3
"""Standard deviation of a followed corner's u and v; Lucas-Kanade on real images keeps 0.1 to 0.5 px."""

HUBER_SIGMAS: Final = 1.345
"""Huber's threshold in standard deviations: Gaussian noise loses 5 % of its information."""

_LEAST_DEPTH_M: Final = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """How a pair observes points.

    Attributes:
        geometry: of the rectified pair.
        noise_px: standard deviation of a disparity, px.
        offset_px: by how much all disparities are too large, px; matchers and rectifications have such an error, 0.1 px as a rule.
        pixel_px: standard deviation of u and v, px.
    """

    geometry: StereoGeometry
    noise_px: float
    offset_px: float = 0.0
    pixel_px: float = FOLLOWING_PX

    @property
    def weights(self) -> Floats:
        """(3,) 1 / standard deviation of u, v and d, 1/px."""
        return np.array([1 / self.pixel_px, 1 / self.pixel_px, 1 / self.noise_px])

    def points(self, observed_px: Floats) -> Floats:
        """Return where observations (..., 3) are, (..., 3), m, in the camera's axes; NaN without a disparity."""
        of = self.geometry
        depth = of.focal_px * of.baseline_m / (observed_px[..., 2] - self.offset_px + of.doffs_px)
        x = (observed_px[..., 0] - of.cx_px) * depth / of.focal_px
        y = (observed_px[..., 1] - of.cy_px) * depth / of.focal_px
        return np.stack((x, y, depth), axis=-1)

    def projected(self, points_m: Floats) -> Floats:
        """Return how points (..., 3), m, in the camera's axes are seen, (..., 3), px; what is behind the camera lands far outside."""
        of = self.geometry
        depth = np.maximum(points_m[..., 2], _LEAST_DEPTH_M)
        u = of.focal_px * points_m[..., 0] / depth + of.cx_px
        v = of.focal_px * points_m[..., 1] / depth + of.cy_px
        return np.stack((u, v, of.focal_px * of.baseline_m / depth - of.doffs_px + self.offset_px), axis=-1)

    def slopes(self, points_m: Floats) -> Floats:
        """Return the derivatives (..., 3, 3) of `projected` by the point, px/m."""
        of, slopes = self.geometry, np.zeros((*points_m.shape, 3))
        inverse = 1 / np.maximum(points_m[..., 2], _LEAST_DEPTH_M)
        near = of.focal_px * inverse
        slopes[..., 0, 0] = slopes[..., 1, 1] = near
        slopes[..., 0, 2] = -near * inverse * points_m[..., 0]
        slopes[..., 1, 2] = -near * inverse * points_m[..., 1]
        slopes[..., 2, 2] = -near * inverse * of.baseline_m
        return slopes


def by_motion(slopes: Floats, points_m: Floats) -> Floats:
    """Return derivatives by a small motion of the points: turn, rad, and shift, m, both in the camera's axes.

    Args:
        slopes: (..., 3, 3) derivatives by the point.
        points_m: (..., 3) the points in the camera's axes.

    Returns:
        (..., 3, 6).
    """
    result = np.empty((*slopes.shape[:-1], 6))
    result[..., 3:] = slopes
    x, y, z = (points_m[..., np.newaxis, axis] for axis in range(3))
    by_x, by_y, by_z = (slopes[..., axis] for axis in range(3))
    result[..., 0] = by_z * y - by_y * z
    result[..., 1] = by_x * z - by_z * x
    result[..., 2] = by_y * x - by_x * y
    return result


def huber(lengths: Floats) -> tuple[Floats, Floats]:
    """Return Huber's cost and weight of errors, each as long as `lengths`, which are in standard deviations."""
    inside = np.minimum(lengths, HUBER_SIGMAS)
    return inside * (2 * lengths - inside), inside / np.maximum(lengths, HUBER_SIGMAS * 1e-9)
