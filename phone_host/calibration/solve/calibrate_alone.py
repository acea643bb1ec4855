"""Calibrates each camera alone, without views that are plainly wrong, and takes their relative pose from single pairs: where `calibrate.py` starts. Pure.

OpenCV's `fisheye.calibrate` starts from half the image's width as the focal length and gives up where a view is ill-conditioned. Here
several fields of view are tried: each gives the corners' rays, the rays give poses, and the one that fits best is
adjusted with all coefficients free.
"""

from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.board_pose import fit_pose, rough_pose
from phone_host.calibration.solve.bundle import adjust_alone, alone_state, rms_px
from phone_host.calibration.solve.bundle_problem import Bend, BundleState, Vector, project_view
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Lens, Side

_FIELDS_RAD: Final = (0.9, 1.2, 1.6, 2.1, 2.7, 3.3)
"""Fields of view across the image's width: 50 to 190 degrees, each a third wider than the one before."""

LEAST_PAIRS = 3
"""Fewer pairs do not determine focal length and distortion (Zhang 2000: two views suffice only without distortion)."""

_STEADY_VIEWS: Final = 5
"""With fewer views OpenCV's search starts steadier with the first radial coefficient alone; the bundle adjustment adds the others."""

# Nothing is certain yet, so only views that are plainly wrong are rejected.
_GROSS_FACTOR, _GROSS_FLOOR_PX = 4.0, 1.0

_STEPS = {
    Bend.USUAL: (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, np.finfo(float).eps),
    Bend.WIDE: (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 300, np.finfo(float).eps),
}
"""OpenCV's own limit is 30 steps. With k3 that leaves views of a wide lens off by 10 px, which then look wrong."""

FAR_OFF_PX: Final = 1000
"""Corners of the right board in a whole photograph are never so far off: the fit has diverged, and its number means nothing."""


def fisheye_camera(views: list[Corners], points_m: Vector, size_px: tuple[int, int]) -> tuple[CameraModel, Vector]:
    """Calibrate one camera with a fisheye lens.

    Returns:
        Its model, and the poses (V, 6).

    Raises:
        DataError: no field of view explains the views.
    """
    starts = [_start(views, points_m, size_px, size_px[0] / field) for field in _FIELDS_RAD]
    known = [start for start in starts if start is not None]
    if not known:
        raise DataError("the views fit no fisheye lens", "show the board nearer to the middle, too")
    _, start = min(known, key=lambda each: each[0])
    found = adjust_alone(views, points_m, start, Bend.FISHEYE.free())
    return found.left, found.poses


def _start(
    views: list[Corners], points_m: Vector, size_px: tuple[int, int], focal_px: float
) -> tuple[float, BundleState] | None:
    """Return the median error with an undistorted fisheye lens, px, and the state; None if the views have no poses in it."""
    matrix = np.array([[focal_px, 0, (size_px[0] - 1) / 2], [0, focal_px, (size_px[1] - 1) / 2], [0, 0, 1]])
    model = CameraModel(
        width_px=size_px[0], height_px=size_px[1], matrix=matrix, distortion=np.zeros(4), lens=Lens.FISHEYE
    )
    try:
        poses = np.array([rough_pose(points_m, corners, model) for corners in views])
    except cv2.error:
        return None
    errors = [
        np.linalg.norm(corners - project(SE3.of(pose).apply(points_m), model), axis=1)
        for corners, pose in zip(views, poses, strict=True)
    ]
    median = float(np.nanmedian(np.concatenate(errors)))
    return (median, alone_state(model, poses)) if np.isfinite(median) else None


@dataclass(frozen=True, slots=True, eq=False)
class LoneCamera:
    """One camera calibrated alone: its model, and the poses (V, 6) of the boards in its axes."""

    side: Side
    parameters: CameraModel
    poses: Vector


def corners_of(pair: BoardPair, side: Side) -> Corners:
    """Return the corners of one side of a pair."""
    return pair.left_px if side is Side.LEFT else pair.right_px


def require_enough(pairs: list[BoardPair], rejected: list[Rejected]) -> None:
    """Check that there are enough pairs for a calibration.

    Raises:
        DataError: fewer than three pairs are left.
    """
    if len(pairs) < LEAST_PAIRS:
        why = f" ({len(rejected)} rejected: {rejected[0].name}: {rejected[0].detail}, ...)" if rejected else ""
        misfits = {Reason.MOVED, Reason.CORNERS_LEFT, Reason.CORNERS_RIGHT}
        is_misfit = any(each.reason in misfits for each in rejected)
        check = "check that the two images of each pair belong together, and " if is_misfit else ""
        raise DataError(
            f"only {len(pairs)} of at least {LEAST_PAIRS} pairs can be used{why}",
            f"{check}take 15 or more pairs with the whole board sharp in both images",
        )


def calibrate_alone(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int], bend: Bend = Bend.USUAL
) -> tuple[list[BoardPair], list[Rejected], LoneCamera]:
    """Calibrate one camera; reject views that are plainly wrong until none is left.

    Returns:
        The pairs left, those rejected, and the camera with one pose for each pair left.

    Raises:
        DataError: fewer than three pairs are left.
    """
    rejected: list[Rejected] = []
    reason = Reason.CORNERS_LEFT if side is Side.LEFT else Reason.CORNERS_RIGHT
    while True:
        require_enough(pairs, rejected)
        camera, errors = _camera(pairs, side, points_m, size_px, bend)
        limit = max(_GROSS_FACTOR * float(np.median(errors)), _GROSS_FLOOR_PX)
        if errors.max() <= limit:
            return pairs, rejected, camera
        worst = int(errors.argmax())  # one at a time: a single wild view distorts the errors of the others
        rejected.append(
            Rejected(
                pairs[worst].name,
                reason,
                f"corners in the {side.value} image are off {off_words(float(errors[worst]), float(np.median(errors)))}",
            )
        )
        pairs = [pair for index, pair in enumerate(pairs) if index != worst]


def off_words(error_px: float, usual_px: float) -> str:
    """Say how far corners are off, as in `by 3.21 px, others by 0.30 px`; beyond a thousand pixels a number means nothing.

    Args:
        error_px: root mean square error of the pair's corners, px.
        usual_px: the same, of the usual pair.
    """
    error, usual = (
        f"by {value:.2f} px" if value <= FAR_OFF_PX else f"by more than {FAR_OFF_PX} px"
        for value in (error_px, usual_px)
    )
    return f"{error}, others {usual}"


def _camera(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int], bend: Bend
) -> tuple[LoneCamera, Vector]:
    """Calibrate one camera from all of the views; return it and each view's root mean square error, px."""
    views = [corners_of(pair, side) for pair in pairs]
    if bend is Bend.FISHEYE:
        model, poses = fisheye_camera(views, points_m, size_px)
    else:
        model, poses = _opencv_camera(views, points_m, size_px, bend)
    camera = LoneCamera(side, model, poses)
    rms = np.array([np.sqrt(np.nanmean((each**2).sum(axis=1))) for each in errors_px(camera, pairs, points_m)])
    return camera, np.where(np.isfinite(rms), rms, np.inf)


def errors_px(camera: LoneCamera, pairs: list[BoardPair], points_m: Vector) -> Vector:
    """Return measured minus projected corners of a camera's views, (V, N, 2) px; NaN where a corner was not seen."""
    return np.array(
        [
            corners_of(pair, camera.side) - project(SE3.of(pose).apply(points_m), camera.parameters)
            for pair, pose in zip(pairs, camera.poses, strict=True)
        ]
    )


def _opencv_camera(
    views: list[Corners], points_m: Vector, size_px: tuple[int, int], bend: Bend
) -> tuple[CameraModel, Vector]:
    """OpenCV's calibration of one camera: its model, and the poses (V, 6)."""
    flags = cv2.CALIB_ZERO_TANGENT_DIST | (0 if bend is Bend.WIDE else cv2.CALIB_FIX_K3)
    if len(views) < _STEADY_VIEWS:
        flags |= cv2.CALIB_FIX_K2
    seen = [np.isfinite(corners).all(axis=1) for corners in views]
    _, matrix, distortion, turns, shifts = cv2.calibrateCamera(
        [points_m[known].astype(np.float32) for known in seen],
        [corners[known].astype(np.float32).reshape(-1, 1, 2) for corners, known in zip(views, seen, strict=True)],
        size_px,
        np.eye(3),
        np.zeros(5),
        flags=flags,
        criteria=_STEPS.get(bend, _STEPS[Bend.USUAL]),
    )
    model = CameraModel(
        width_px=size_px[0],
        height_px=size_px[1],
        matrix=np.asarray(matrix, np.float64),
        distortion=np.ravel(distortion)[:5].astype(np.float64),
    )
    poses = [np.concatenate([np.ravel(r), np.ravel(t)]) for r, t in zip(turns, shifts, strict=True)]
    return model, np.array(poses, np.float64)


def with_poses(camera: LoneCamera, pairs: list[BoardPair], points_m: Vector) -> LoneCamera:
    """Return the camera with one pose for each of the pairs that are left."""
    poses = [fit_pose(points_m, corners_of(pair, camera.side), camera.parameters) for pair in pairs]
    return replace(camera, poses=np.array(poses))


def own_errors_px(points_m: Vector, corners: Corners, model: CameraModel) -> Vector:
    """Return (N, 2) measured minus projected corners of one view, px, with the board's pose fitted to this view alone."""
    pose = fit_pose(points_m, corners, model)
    return np.asarray(corners - project(SE3.of(pose).apply(points_m), model), dtype=np.float64)


def states_of(left: LoneCamera, right: LoneCamera) -> list[BundleState]:
    """Return the rig that each pair gives on its own."""
    return [
        replace(state_of(left.parameters, right.parameters, a, b), poses=left.poses)
        for a, b in zip(left.poses, right.poses, strict=True)
    ]


def state_of(left: CameraModel, right: CameraModel, left_pose: Vector, right_pose: Vector) -> BundleState:
    """Return the rig that one pair gives."""
    pose = (SE3.of(right_pose) @ SE3.of(left_pose).inverse()).pose()
    return BundleState(left=left, right=right, rotation=pose[:3], translation_m=pose[3:], poses=left_pose[np.newaxis])


def prediction_errors_px(states: list[BundleState], right_px: list[Corners], points_m: Vector) -> Vector:
    """Predict the right corners of all pairs from their left poses, by the rig that each pair gives.

    Returns:
        (V, V) root mean square error, px: rig by pair.
    """
    return np.array(
        [
            [
                rms_px(seen - project_view(state, pose, points_m)[1])
                for seen, pose in zip(right_px, state.poses, strict=True)
            ]
            for state in states
        ]
    )
