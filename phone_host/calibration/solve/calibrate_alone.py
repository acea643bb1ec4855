"""Calibrates one camera alone, without views that are plainly wrong. Gives `calibrate.py` its start. Pure."""

from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle import Vector
from phone_host.calibration.solve.fisheye_start import fisheye_camera
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Side

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
        check = "check that the two images of each pair belong together, and " if _misfits(rejected) else ""
        raise DataError(
            f"only {len(pairs)} of at least {LEAST_PAIRS} pairs can be used{why}",
            f"{check}take 15 or more pairs with the whole board sharp in both images",
        )


def _misfits(rejected: list[Rejected]) -> bool:
    """Whether a pair was rejected because it does not fit the others."""
    return any(each.reason in {Reason.MOVED, Reason.CORNERS_LEFT, Reason.CORNERS_RIGHT} for each in rejected)


def calibrate_alone(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int], bend: Bend = Bend.USUAL
) -> tuple[list[BoardPair], list[Rejected], LoneCamera]:
    """Calibrate one camera; reject views that are plainly wrong until none is left.

    Args:
        pairs: all pairs.
        side: which of their views to look at.
        points_m: (N, 3) corners in the board's axes.
        size_px: width and height of the side's images.
        bend: how freely its lens may bend.

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
    """Return measured minus projected corners of a camera's views, (V, N, 2) px; NaN where a corner was not seen.

    Args:
        camera: with one pose for each pair.
        pairs: V pairs.
        points_m: (N, 3) corners in the board's axes.
    """
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
