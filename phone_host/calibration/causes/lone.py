"""Each camera alone, for the search for causes: a lens of nine numbers, a pose for each view, and what they leave. Pure.

The search needs one simple lens for all of its rules, whatever lens the calibration chooses in the end. Corners that were
not seen are NaN.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.target import Corners
from phone_host.model import Side

Vector = NDArray[np.float64]

LENS: Final = 9
"""Numbers of a lens: fx fy cx cy k1 k2 p1 p2 k3."""

LEAST_VIEWS: Final = 3
_LEAST_CORNERS: Final = 6
_USUAL_VIEWS: Final = 5
"""With fewer views only the first radial coefficient is estimated."""

_FAR_FACTOR, _FAR_FLOOR_PX = 4.0, 1.0
"""A view whose corners are off by more than four times the median view's, and a pixel, is left out."""

_STEPS: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, float(np.finfo(float).eps))


@dataclass(frozen=True, slots=True, eq=False)
class Lone:
    """One camera: its lens (9,), the poses (V, 6) of the boards in its axes, and the squares that are left, px^2."""

    lens: Vector
    poses: Vector
    squares_px2: float


def both_alone(
    pairs: list[BoardPair], points_m: Vector, sizes_px: tuple[tuple[int, int], ...]
) -> tuple[list[BoardPair], Lone, Lone] | None:
    """Calibrate each camera alone, without views that are plainly wrong.

    Args:
        pairs: the corners.
        points_m: (N, 3) corners in the board's axes.
        sizes_px: width and height of the left and of the right images.

    Returns:
        The pairs left and both cameras; None if fewer than three are left.

    Raises:
        cv2.error: no lens explains the views.
    """
    kept, lenses = list(pairs), []
    for side, size_px in zip(Side, sizes_px, strict=True):
        found = _lens(kept, side, points_m, size_px)
        if found is None:
            return None
        kept, lens = found
        lenses.append(lens)
    left, right = (
        _with_poses([corners_of(pair, side) for pair in kept], lens, points_m)
        for side, lens in zip(Side, lenses, strict=True)
    )
    return kept, left, right


def corners_of(pair: BoardPair, side: Side) -> Corners:
    """Return the corners of one side of a pair."""
    return pair.left_px if side is Side.LEFT else pair.right_px


def camera_arrays(lens: Vector) -> tuple[Vector, Vector]:
    """Return a lens as OpenCV's camera matrix (3, 3) and distortion (5,)."""
    return np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]]), lens[4:]


def fit_pose(points_m: Vector, corners: Corners, lens: Vector) -> Vector:
    """Return the (6,) pose of the board that best fits one view."""
    seen = np.isfinite(corners).all(axis=1)
    _, turn, shift = cv2.solvePnP(points_m[seen], corners[seen], *camera_arrays(lens), flags=cv2.SOLVEPNP_ITERATIVE)
    return np.concatenate([np.ravel(turn), np.ravel(shift)]).astype(np.float64)


def project(points_m: Vector, pose: Vector, lens: Vector) -> Vector:
    """Return where a camera sees a board at a pose, (N, 2) px."""
    seen = cv2.projectPoints(points_m, pose[:3], pose[3:], *camera_arrays(lens))[0]
    return np.asarray(seen, np.float64).reshape(-1, 2)


def rms_px(errors: Vector) -> float:
    """Return the root mean square length of (..., 2) errors, px, of the corners that were seen."""
    return float(np.sqrt(np.nanmean((errors**2).sum(axis=-1))))


def relative_pose(left: Vector, right: Vector) -> Vector:
    """Return the pose (6,) that takes the left camera's axes to the right one's, from two poses of one board."""
    inverse = cv2.Rodrigues(-left[:3])[0]
    turn, shift = cv2.composeRT(-left[:3], -inverse @ left[3:], right[:3], right[3:])[:2]
    return np.concatenate([np.ravel(turn), np.ravel(shift)]).astype(np.float64)


def seen_right(rig: Vector, left_pose: Vector, points_m: Vector, lens: Vector) -> Vector:
    """Return where the right camera sees a board that the left one sees at a pose, (N, 2) px."""
    turn, shift = cv2.composeRT(left_pose[:3], left_pose[3:], rig[:3], rig[3:])[:2]
    return project(points_m, np.concatenate([np.ravel(turn), np.ravel(shift)]).astype(np.float64), lens)


def apart_px(pairs: list[BoardPair], left: Lone, right: Lone, points_m: Vector) -> tuple[Vector, Vector]:
    """Return how far each pair's right view is from where the rig that most agree on predicts it, (V,) px, and that rig (6,)."""
    rigs = [relative_pose(a, b) for a, b in zip(left.poses, right.poses, strict=True)]
    errors = np.array(
        [
            [
                rms_px(pair.right_px - seen_right(rig, pose, points_m, right.lens))
                for pair, pose in zip(pairs, left.poses, strict=True)
            ]
            for rig in rigs
        ]
    )
    best = int(np.median(errors, axis=1).argmin())
    return errors[best], rigs[best]


def lone_lens(pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int]) -> Vector | None:
    """Return the lens of one side; None if fewer than three views fit one.

    Raises:
        cv2.error: no lens explains the views.
    """
    found = _lens(pairs, side, points_m, size_px)
    return None if found is None else found[1]


def _lens(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int]
) -> tuple[list[BoardPair], Vector] | None:
    """Return the pairs whose view on one side fits a lens, and that lens."""
    kept = [pair for pair in pairs if np.isfinite(corners_of(pair, side)).all(axis=1).sum() >= _LEAST_CORNERS]
    while len(kept) >= LEAST_VIEWS:
        lens, errors = _opencv_lens([corners_of(pair, side) for pair in kept], points_m, size_px)
        if errors.max() <= max(_FAR_FACTOR * float(np.median(errors)), _FAR_FLOOR_PX):
            return kept, lens
        worst = int(errors.argmax())  # one at a time: a wild view distorts the errors of the others
        kept = [pair for index, pair in enumerate(kept) if index != worst]
    return None


def _opencv_lens(views: list[Corners], points_m: Vector, size_px: tuple[int, int]) -> tuple[Vector, Vector]:
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    if len(views) < _USUAL_VIEWS:
        flags |= cv2.CALIB_FIX_K2
    seen = [np.isfinite(view).all(axis=1) for view in views]
    _, matrix, distortion, _, _, _, _, errors = cv2.calibrateCameraExtended(
        [points_m[mask].astype(np.float32) for mask in seen],
        [view[mask].astype(np.float32).reshape(-1, 1, 2) for view, mask in zip(views, seen, strict=True)],
        size_px,
        np.eye(3),
        np.zeros(5),
        flags=flags,
        criteria=_STEPS,
    )
    lens = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(distortion)[:5]], np.float64)
    return lens, np.asarray(errors, np.float64).ravel()


def _with_poses(views: list[Corners], lens: Vector, points_m: Vector) -> Lone:
    poses = np.array([fit_pose(points_m, view, lens) for view in views])
    left = [view - project(points_m, pose, lens) for view, pose in zip(views, poses, strict=True)]
    return Lone(lens, poses, float(np.nansum(np.square(left))))
