"""How a rectified pair sees points, (u, v, d) with their noise, and where the camera is that sees them so. Pure.

u and v come from following a corner, d from the matcher, so their errors are independent. Without a disparity d is NaN and counts nothing. The consensus comes
from pixels alone; the refinement uses disparities as well, each weighted by its noise.

Source: R. Hartley and A. Zisserman, "Multiple View Geometry", 2004, sections 4.7 and A6.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

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
    """Return derivatives (..., 3, 6) by a small motion of points (..., 3) in the camera's axes, turn, rad, and shift, m, from those by the points, (..., 3, 3)."""
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


LEAST_INLIERS: Final = 12
"""Fewer agree by accident with a wrong motion."""

_CONSENSUS_PX: Final = 2.0
_CONSENSUS_SIGMAS: Final = 4.0
_DRAWS: Final = 200
_CERTAINTY: Final = 0.999
_STEPS: Final = 10
_STILL: Final = 1e-7
"""rad and m: a step as short as this ends the search."""

_OUTLIER_SIGMAS: Final = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class CameraPose:
    """A camera that was located.

    Attributes:
        camera_world: takes the world's points to the camera.
        inliers: (N,) which of the points agree with it.
    """

    camera_world: SE3
    inliers: Flags


def located(points_m: Floats, observed_px: Floats, observer: Observer, draws: int = _DRAWS) -> CameraPose | None:
    """Locate a camera.

    Args:
        points_m: (N, 3) points in the world.
        observed_px: (N, 3) u, v, d of each; d NaN = none.
        observer: how they are measured.
        draws: at most, for the consensus.

    Returns:
        The pose, or None: too few points agree on one.
    """
    if len(points_m) < LEAST_INLIERS:
        return None
    start = _consensus(points_m, observed_px, observer, draws)
    if start is None:
        return None
    pose = refined(start.camera_world, points_m[start.inliers], observed_px[start.inliers], observer)
    near = _lengths(pose, points_m, observed_px, observer) < _OUTLIER_SIGMAS
    if np.count_nonzero(near) < LEAST_INLIERS or not np.isfinite(pose.t_m).all():
        return None
    return CameraPose(refined(pose, points_m[near], observed_px[near], observer), near)


def _consensus(points_m: Floats, observed_px: Floats, observer: Observer, draws: int) -> CameraPose | None:
    """Find the pose on which most pixels agree; the draws are the same each time (OpenCV seeds them so)."""
    of = observer.geometry
    matrix = np.array([[of.focal_px, 0, of.cx_px], [0, of.focal_px, of.cy_px], [0, 0, 1]])
    try:
        found, turn, shift, chosen = cv2.solvePnPRansac(
            points_m,
            np.ascontiguousarray(observed_px[:, :2]),
            matrix,
            None,
            iterationsCount=draws,
            reprojectionError=max(_CONSENSUS_PX, _CONSENSUS_SIGMAS * observer.pixel_px),
            confidence=_CERTAINTY,
            flags=cv2.SOLVEPNP_AP3P,
        )
    except cv2.error:  # points that determine nothing, such as all on one line
        return None
    inliers = np.zeros(len(points_m), np.bool_)
    if found:  # else `chosen` is None
        inliers[np.asarray(chosen).ravel()] = True
    if np.count_nonzero(inliers) < LEAST_INLIERS:
        return None
    pose = np.concatenate([np.asarray(turn, np.float64).ravel(), np.asarray(shift, np.float64).ravel()])
    return CameraPose(SE3.of(pose), inliers) if np.isfinite(pose).all() else None


def refined(camera_world: SE3, points_m: Floats, observed_px: Floats, observer: Observer) -> SE3:
    """Minimise Huber's cost of observations (N, 3), u, v, d, NaN = none, of points (N, 3), m, over the pose, by Gauss and Newton; the start where they determine none."""
    pose, weights = camera_world, observer.weights
    for _ in range(_STEPS):
        seen = pose.apply(points_m)
        errors = np.nan_to_num((observed_px - observer.projected(seen)) * weights, nan=0.0)
        slopes = by_motion(observer.slopes(seen), seen) * weights[:, np.newaxis]
        slopes[~np.isfinite(observed_px)] = 0
        robust = huber(np.linalg.norm(errors, axis=1))[1]
        weighted = (slopes * robust[:, np.newaxis, np.newaxis]).reshape(-1, 6)
        flat = slopes.reshape(-1, 6)
        try:
            step = np.asarray(np.linalg.solve(weighted.T @ flat, weighted.T @ errors.ravel()), np.float64)
        except np.linalg.LinAlgError:
            return camera_world
        pose = SE3.of(step) @ pose
        if np.abs(step).max() < _STILL:
            break
    return pose


def _lengths(pose: SE3, points_m: Floats, observed_px: Floats, observer: Observer) -> Floats:
    errors = (observed_px - observer.projected(pose.apply(points_m))) * observer.weights
    return np.asarray(np.linalg.norm(np.nan_to_num(errors, nan=0.0), axis=1), np.float64)
