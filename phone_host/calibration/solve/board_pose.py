"""The pose of a board that best explains one camera's view of it. Pure."""

from typing import Final

import cv2
import numpy as np

from phone_host.calibration.solve.bundle import alone_state, fit_poses
from phone_host.calibration.solve.bundle_problem import BundleView, Vector
from phone_host.calibration.target.corners import Corners
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import CameraModel, Lens

_LEAST_FORWARD: Final = 0.1
"""Cosine: rays more than 84 degrees from the middle of the board have no slope that a pose could start from."""

_LEAST_CORNERS: Final = 4


def fit_pose(points_m: Vector, corners: Corners, model: CameraModel) -> Vector:
    """Return the (6,) pose of the board that best fits one view."""
    seen = np.isfinite(corners).all(axis=1)
    if model.lens is not Lens.FISHEYE:
        _, rotation, translation = cv2.solvePnP(
            points_m[seen], corners[seen], model.matrix, model.distortion, flags=cv2.SOLVEPNP_ITERATIVE
        )
        return np.concatenate([np.ravel(rotation), np.ravel(translation)]).astype(np.float64)
    state = alone_state(model, rough_pose(points_m, corners, model)[np.newaxis])
    alone = BundleView(corners, np.full(corners.shape, np.nan))
    pose: Vector = fit_poses([alone], points_m, state).state.poses[0]
    return pose


def rough_pose(points_m: Vector, corners: Corners, model: CameraModel) -> Vector:
    """Return a (6,) pose that fits the rays of the corners, without weighing them by their pixels.

    Raises:
        cv2.error: fewer than four corners have rays.
    """
    rays = rays_through(corners, model)
    usable = np.isfinite(rays).all(axis=1)
    if usable.sum() < _LEAST_CORNERS:
        raise cv2.error("the view has no rays that a pose could start from")
    # A fisheye lens may see the board aside of its own image plane: look towards the board instead.
    turn = _turn_to(rays[usable])
    ahead = rays[usable] @ turn.T
    slopes = ahead[:, :2] / np.maximum(ahead[:, 2:], _LEAST_FORWARD * np.linalg.norm(ahead, axis=1, keepdims=True))
    _, rotation, translation = cv2.solvePnP(points_m[usable], slopes, np.eye(3), None, flags=cv2.SOLVEPNP_ITERATIVE)
    pose = np.concatenate([np.ravel(rotation), np.ravel(translation)]).astype(np.float64)
    return (SE3(turn.T, np.zeros(3)) @ SE3.of(pose)).pose()


def towards(corners: Corners, model: CameraModel) -> Vector:
    """Return the (3, 3) turn from a camera's axes to those of one that looks at the middle of what it sees."""
    rays = rays_through(corners, model)
    return _turn_to(rays[np.isfinite(rays).all(axis=1)])


def _turn_to(rays: Vector) -> Vector:
    """Return the (3, 3) shortest turn that brings the middle of rays (M, 3) onto the z axis; none, if there are no rays."""
    middle = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).sum(axis=0)
    axis = np.cross(middle, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    return rotations_of(axis / sine * np.arctan2(sine, middle[2]) if sine > 0 else np.zeros(3))
