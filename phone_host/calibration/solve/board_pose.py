"""The pose of a board that best explains one camera's view of it, and the plane of a board in a rectified image. Pure.

The pose comes from the left image and the size of the squares alone. It does not use the cameras' distance, so that a wrong
baseline shows as a bias of the depth, and it is several times as certain as the depth: a board is wider than a rig.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.solve.bundle import alone_state, fit_poses
from phone_host.calibration.solve.bundle_problem import Vector, left_alone
from phone_host.calibration.target.corners import Board, Corners, agree, find_corners
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import CameraModel, DisparityPlane, Epipolar, Lens, RectifiedPair, StereoGeometry
from phone_host.stereo.plane_fit import plane_at, plane_in_disparity

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
    pose: Vector = fit_poses(left_alone([corners]), points_m, state).state.poses[0]
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


_MOST_MISFIT_PX: Final = 1.5
"""Corners are found to 0.1 px; a flat board of equal squares explains them to about that."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BoardPlane:
    """A board in a rectified left image.

    Attributes:
        plane: where it is, as disparities.
        outline_px: (4, 2) float64, its outermost inner corners in order around it, px.
        middle_px: where its middle is seen, px.
        misfit_px: RMS distance of the corners from where this pose puts them, px.
        corners_bias_share: by which share the depths of its corners, from their own disparities, exceed the plane's: the bias
            of the rig alone, without that of matching; NaN: not known.
    """

    plane: DisparityPlane
    outline_px: NDArray[np.float64]
    middle_px: tuple[float, float]
    misfit_px: float
    corners_bias_share: float = math.nan

    def covers(self, width_px: int, height_px: int) -> NDArray[np.bool_]:
        """Return which pixels of an image of this size lie inside the outline: (H, W) bool."""
        mask = np.zeros((height_px, width_px), np.uint8)
        cv2.fillConvexPoly(mask, self.outline_px.round().astype(np.int32), 1)
        return mask.astype(np.bool_)


def find_board_plane(pair: RectifiedPair, board: Board, geometry: StereoGeometry, name: str) -> BoardPlane:
    """Find a board and its plane.

    Returns:
        The board.

    Raises:
        DataError: it is not seen, or what is seen is no flat board with such squares.
    """
    corners = find_corners(pair.left, board)
    size = f"{board.columns}x{board.rows}"
    if not len(corners):
        raise DataError(
            f"no board with {size} inner corners is seen whole and sharp in {name}, rectified",
            "hold it so that both cameras see all of it, check --board, or give --distance instead",
        )
    found = board_plane_of(corners, board, geometry)
    if found.misfit_px > _MOST_MISFIT_PX:
        raise DataError(
            f"the corners in {name} lie {found.misfit_px:.1f} px off those of a flat {size} board",
            "take a flat board whose squares are all of one size, and a rig.yaml that fits these cameras",
        )
    partners = find_corners(pair.right, board)
    if not len(partners):
        return found
    share = corners_bias_share(corners, agree(corners, partners, board), found.plane, geometry, pair.epipolar)
    return replace(found, corners_bias_share=share)


def corners_bias_share(
    left: Corners, right: Corners, plane: DisparityPlane, geometry: StereoGeometry, epipolar: Epipolar
) -> float:
    """Return by which share the depths of corners (N, 2), the same in both rectified images, exceed those of a plane, in the mean; NaN: they have none."""
    apart = left - right
    disparity = {Epipolar.LEFT: apart[:, 0], Epipolar.UP: apart[:, 1], Epipolar.DOWN: -apart[:, 1]}[epipolar]
    true = plane_at(plane, left[:, 0], left[:, 1])
    near_px = float(np.mean(disparity)) + geometry.doffs_px  # z goes as 1 / (d + doffs)
    return float(np.mean(true - disparity)) / near_px if near_px > 0 else math.nan


def board_plane_of(corners: Corners, board: Board, geometry: StereoGeometry) -> BoardPlane:
    """Compute the plane of a board from its corners (N, 2) in the rectified left image, px."""
    points = board.points_m()
    model = _rectified_camera(geometry)
    pose = fit_pose(points, corners, model)
    rotation, centre = np.asarray(cv2.Rodrigues(pose[:3])[0], np.float64), pose[3:]
    seen = cv2.projectPoints(points, pose[:3], pose[3:], model.matrix, model.distortion)[0].reshape(-1, 2)
    normal = rotation[:, 2]
    middle = rotation @ points.mean(axis=0) + centre
    grid = corners.reshape(board.rows, board.columns, 2)
    return BoardPlane(
        plane=plane_in_disparity(normal / float(normal @ centre), geometry),
        outline_px=np.array([grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]]),
        middle_px=(
            float(geometry.focal_px * middle[0] / middle[2] + geometry.cx_px),
            float(geometry.focal_px * middle[1] / middle[2] + geometry.cy_px),
        ),
        misfit_px=float(np.sqrt(np.mean(np.sum(np.square(seen - corners), axis=1)))),
    )


def _rectified_camera(geometry: StereoGeometry) -> CameraModel:
    """Return the pinhole camera that would have taken the rectified left image; its size does not matter here."""
    matrix = np.array([[geometry.focal_px, 0, geometry.cx_px], [0, geometry.focal_px, geometry.cy_px], [0, 0, 1.0]])
    return CameraModel(width_px=1, height_px=1, matrix=matrix, distortion=np.zeros(5))
