"""Where the camera is, from points in the world and how it sees them. Pure.

The consensus comes from pixels alone; the refinement uses disparities as well, each weighted by its noise.
Source: R. Hartley and A. Zisserman, "Multiple View Geometry", 2004, sections 4.7 and A6.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.observation import Observer, by_motion, huber

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

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
    """Minimise Huber's cost of all observations over the pose, by Gauss and Newton.

    Args:
        camera_world: where to start.
        points_m: (N, 3) points in the world.
        observed_px: (N, 3) u, v, d; d NaN = none.
        observer: how they are measured.

    Returns:
        The pose; the start where the points determine none.
    """
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
