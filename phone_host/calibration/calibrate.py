"""Calibrates two cameras from pairs of chessboard views: corners in, a rig and its figures out.

A core: corners in, values out; no files. Every pair is used or rejected with its reason.

Order: each camera alone (any size, any lens) -> the relative pose that most pairs agree on -> bundle adjustment of all
(`bundle.py`) -> pairs that do not fit are rejected and the adjustment is repeated until nothing changes. If pairs were
rejected, all of them get a second chance with a wide lens's distortion.
"""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.board_pairs import BoardPair, Calibration, Reason, Rejected, Used
from phone_host.calibration.bundle import (
    BundleResult,
    BundleState,
    BundleView,
    Vector,
    adjust,
    camera_arrays,
    globals_of,
    rms_px,
)
from phone_host.calibration.calibrate_alone import (
    FAR_OFF_PX,
    USUAL_PAIRS,
    Lens,
    LoneCamera,
    calibrate_alone,
    corners_of,
    off_words,
    own_errors_px,
    require_enough,
    with_poses,
)
from phone_host.calibration.relative_pose import prediction_errors_px, states_of
from phone_host.calibration.target import Board, Corners
from phone_host.calibration.zero_sigma import zero_sigma_px
from phone_host.model import CameraModel, Rectification, Rig, Side
from phone_host.stereo.rectify import across_lines_px, rectify_points, rectify_rig

Sizes = tuple[tuple[int, int], tuple[int, int]]
"""Width and height of the left and of the right images, px."""

# Camera parameters in the order of bundle.py: fx fy cx cy k1 k2 p1 p2 k3.
_RADIAL_1 = np.array([1, 1, 1, 1, 1, 0, 0, 0, 0], dtype=bool)
_USUAL = np.array([1, 1, 1, 1, 1, 1, 1, 1, 0], dtype=bool)
_FULL = np.ones(9, dtype=bool)
# The third radial coefficient bends the corners of the image, which few boards reach. It is used only with many pairs
# and only if it explains 1 % of the error. Of four real rigs one gains that much (0.182 -> 0.178 px); the others gain
# 0.8 % or less.
_FULL_PAIRS, _FULL_GAIN = 10, 0.01
# By how much the error may grow when rejected pairs come back: a twelfth pair with the same noise changes it by some per
# cent either way, a pair that does not belong by a multiple.
_CHANCE_LOSS = 0.05

# A pair is rejected when its error is twice the median pair's, but never below this floor: smaller errors do no harm.
_OUTLIER_FACTOR, _OUTLIER_FLOOR_PX = 2.0, 0.3
# Row errors carry a third of the information and scatter more from pair to pair.
_ROWS_FACTOR = 2.5
# Limits for the right view predicted from the left one, while the cameras are not yet adjusted to each other.
_MOVED_FACTOR, _MOVED_FLOOR_PX = 5.0, 3.0


def calibrate(
    pairs: list[BoardPair],
    board: Board,
    sizes_px: Sizes,
    board_side: Side = Side.LEFT,
) -> Calibration:
    """Calibrate a rig from the corners of a chessboard seen by both cameras.

    Args:
        pairs: corners of each pair, any number.
        board: the board.
        sizes_px: width and height of the left and of the right images.
        board_side: which camera is on the board (the computer); stored in the rig.

    Returns:
        The calibration, with every pair used or rejected.

    Raises:
        DataError: fewer than three pairs are left.
    """
    points_m = board.points_m()
    fitted = _best_fit(pairs, points_m, sizes_px)
    return _summed_up(fitted, points_m=points_m, sizes_px=sizes_px, board_side=board_side)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Fitted:
    """A rig fitted to the pairs that it explains: the optimum, those pairs, the others, and which camera parameters were estimated."""

    result: BundleResult
    kept: list[BoardPair]
    rejected: list[Rejected]
    free: NDArray[np.bool_]


def _fitted(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes, lens: Lens) -> _Fitted:
    """Fit a rig to the pairs, and reject those that do not fit it.

    Raises:
        DataError: fewer than three pairs are left.
    """
    kept, rejected = list(pairs), list[Rejected]()
    alone: list[LoneCamera] = []
    for side, size_px in zip(Side, sizes_px, strict=True):
        kept, out, camera = calibrate_alone(kept, side, points_m, size_px, lens)
        rejected += out
        alone.append(camera)
    left, right = (with_poses(camera, kept, points_m) for camera in alone)
    start, kept, out = _agreed_start(kept, points_m, left, right)
    rejected += out
    result, kept, out, free = _adjust_robustly(kept, points_m, start, sizes_px, lens)
    return _Fitted(result=result, kept=kept, rejected=rejected + out, free=free)


def _best_fit(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes) -> _Fitted:
    """Fit a rig. If pairs are rejected, judge all of them again with a wide lens's distortion; keep that if it explains more pairs, and no worse.

    Raises:
        DataError: fewer than three pairs are left.
    """
    try:
        first = _fitted(pairs, points_m, sizes_px, Lens.USUAL)
    except DataError:
        second = _with_wide_lens(pairs, points_m, sizes_px)
        if second is None:
            raise
        return second
    second = _with_wide_lens(pairs, points_m, sizes_px) if first.rejected else None
    if second is None or len(second.kept) <= len(first.kept):
        return first
    return second if second.result.rms_px() <= (1 + _CHANCE_LOSS) * first.result.rms_px() else first


def _with_wide_lens(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes) -> _Fitted | None:
    """Fit a rig with a wide lens's distortion; None if there are too few pairs for it or it leads nowhere."""
    if len(pairs) < _FULL_PAIRS:
        return None
    try:
        fitted = _fitted(pairs, points_m, sizes_px, Lens.WIDE)
    except (DataError, cv2.error, np.linalg.LinAlgError):  # the richer model may fail where the usual one holds
        return None
    return fitted if _all_invertible(fitted.result.state, sizes_px) else None


def _agreed_start(
    pairs: list[BoardPair], points_m: Vector, left: LoneCamera, right: LoneCamera
) -> tuple[BundleState, list[BoardPair], list[Rejected]]:
    """Find the relative pose of the one pair that most others agree with; reject pairs that disagree.

    Each pair gives a relative pose on its own. It is judged by how well it predicts the right corners of all pairs from
    their left poses. The median over the pairs ignores how large the outliers are.
    """
    states = states_of(left, right)
    errors = prediction_errors_px(states, [pair.right_px for pair in pairs], points_m)
    best = int(np.median(errors, axis=1).argmin())
    usual = float(np.median(errors[best]))
    inside = errors[best] <= max(_MOVED_FACTOR * usual, _MOVED_FLOOR_PX)
    rejected = [
        Rejected(
            pair.name,
            Reason.MOVED,
            f"left and right show the board in different places ({error:.1f} px, others {usual:.1f} px): it moved between the"
            " two exposures, or these images do not belong together",
        )
        for pair, error, good in zip(pairs, errors[best], inside, strict=True)
        if not good
    ]
    kept = [pair for pair, good in zip(pairs, inside, strict=True) if good]
    require_enough(kept, rejected)
    return replace(states[best], poses=left.poses[inside]), kept, rejected


def _adjust_robustly(
    pairs: list[BoardPair], points_m: Vector, start: BundleState, sizes_px: Sizes, lens: Lens
) -> tuple[BundleResult, list[BoardPair], list[Rejected], NDArray[np.bool_]]:
    """Adjust, reject the worst pair and adjust again until all fit; then choose the distortion model."""
    rejected: list[Rejected] = []
    while True:
        free = _FULL if lens is Lens.WIDE else _USUAL if len(pairs) >= USUAL_PAIRS else _RADIAL_1
        views = [BundleView(pair.left_px, pair.right_px) for pair in pairs]
        result = adjust(views, points_m, start, free, sizes_px)
        misfits = _misfits(pairs, result, points_m, sizes_px)
        if not misfits:
            break
        worst, why = misfits[0]  # one at a time: the worst pair distorts the errors of the others
        rejected.append(why)
        pairs = [pair for index, pair in enumerate(pairs) if index != worst]
        require_enough(pairs, rejected)
        start = replace(result.state, poses=np.delete(result.state.poses, worst, axis=0))
    if lens is Lens.USUAL and len(pairs) >= _FULL_PAIRS:
        full = adjust(views, points_m, result.state, _FULL, sizes_px)
        if full.rms_px() < (1 - _FULL_GAIN) * result.rms_px() and _all_invertible(full.state, sizes_px):
            return full, pairs, rejected, _FULL
    return result, pairs, rejected, free


def _misfits(
    pairs: list[BoardPair], result: BundleResult, points_m: Vector, sizes_px: Sizes
) -> list[tuple[int, Rejected]]:
    """Find pairs that fit much worse than the others, worst first: by reprojection error, or by rows that do not match."""
    errors = np.max(result.view_rms_px(), axis=0)
    usual = float(np.median(errors))
    by_error = errors / max(_OUTLIER_FACTOR * usual, _OUTLIER_FLOOR_PX)
    found = [
        (
            by_error[index],
            index,
            _misfit(pairs[index], result.state, points_m, error_px=float(errors[index]), usual_px=usual),
        )
        for index in np.flatnonzero(by_error > 1)
    ]
    try:
        rig = _rig(result.state, sizes_px)
        rectification = rectify_rig(rig)
    except DataError:  # swapped, vertical, ...: the same check reports it at the end
        vertical = np.zeros(len(pairs))
    else:
        vertical = np.array([_rms(_vertical_errors_px(pair, rig, rectification)) for pair in pairs])
    usual = float(np.median(vertical))
    by_rows = vertical / max(_ROWS_FACTOR * usual, _OUTLIER_FLOOR_PX)
    found += [
        (
            by_rows[index],
            index,
            Rejected(
                pairs[index].name,
                Reason.MOVED,
                f"rows of left and right differ by {vertical[index]:.2f} px, others by {usual:.2f} px: board or cameras"
                " moved between the two exposures",
            ),
        )
        for index in np.flatnonzero(by_rows > 1)
    ]
    return [(int(index), why) for _, index, why in sorted(found, key=lambda each: -each[0])]


def _all_invertible(state: BundleState, sizes_px: Sizes) -> bool:
    """Return whether both radial models grow all the way to the image's corners; if one folds back, the fit has failed."""
    return all(_grows(parameters, size) for parameters, size in zip((state.left, state.right), sizes_px, strict=True))


def _grows(parameters: Vector, size_px: tuple[int, int]) -> bool:
    fx, fy, cx, cy, k1, k2, _, _, k3 = parameters
    farthest = math.hypot(max(cx, size_px[0] - cx) / fx, max(cy, size_px[1] - cy) / fy)
    radii = np.linspace(
        0, farthest * 1.1, 200
    )  # the distorted radius is the image's; the true one may be a tenth larger
    return bool((1 + 3 * k1 * radii**2 + 5 * k2 * radii**4 + 7 * k3 * radii**6 > 0).all())


def _misfit(pair: BoardPair, state: BundleState, points_m: Vector, *, error_px: float, usual_px: float) -> Rejected:
    """Say why a pair does not fit: fitting each view alone shows whether corners jump or the board moved."""
    own = {
        side: rms_px(own_errors_px(points_m, corners_of(pair, side), parameters))
        for side, parameters in ((Side.LEFT, state.left), (Side.RIGHT, state.right))
    }
    side = max(own, key=lambda each: own[each])
    # If a view fitted alone already has more than half of the error, the fault is in its corners.
    if own[side] > error_px / 2:
        reason = Reason.CORNERS_LEFT if side is Side.LEFT else Reason.CORNERS_RIGHT
        detail = f"corners in the {side.value} image are off {off_words(own[side], usual_px)}"
        if own[side] > FAR_OFF_PX:
            detail += ": the two images may not belong together"
    else:
        reason = Reason.MOVED
        detail = f"each view fits alone, together they are off {off_words(error_px, usual_px)}: " + (
            "the two images do not belong together"
            if error_px > FAR_OFF_PX
            else "board or cameras moved between the two exposures"
        )
    return Rejected(pair.name, reason, detail)


def _summed_up(fitted: _Fitted, *, points_m: Vector, sizes_px: Sizes, board_side: Side) -> Calibration:
    """Make a rig and its figures from the optimum."""
    result, pairs = fitted.result, fitted.kept
    state = result.state
    rig = replace(
        _rig(state, sizes_px),
        board_side=board_side,
        rms_left_px=_alone_rms_px(pairs, Side.LEFT, points_m, state.left),
        rms_right_px=_alone_rms_px(pairs, Side.RIGHT, points_m, state.right),
        rms_stereo_px=result.rms_px(),
    )
    rectification, obstacle = None, None
    vertical = np.full((len(pairs), len(points_m)), np.nan)
    try:
        rectification = rectify_rig(rig)
    except DataError as error:
        obstacle = error
    else:
        vertical = np.array([_vertical_errors_px(pair, rig, rectification) for pair in pairs])
        sigma_px = zero_sigma_px(result.covariance, globals_of(state), rig, rectification)
        rig = replace(rig, zero_sigma_px=sigma_px)
    used = tuple(
        Used(name=pair.name, left_px=float(a), right_px=float(b), vertical_px=_rms(v))
        for pair, a, b, v in zip(pairs, *result.view_rms_px(), vertical, strict=True)
    )
    return Calibration(
        rig=rig,
        rectification=rectification,
        obstacle=obstacle,
        used=used,
        rejected=tuple(fitted.rejected),
        vertical_px=np.abs(vertical).ravel(),
        baseline_sigma_m=result.baseline_sigma_m,
        tilts_deg=np.array([_tilt_deg(pose) for pose in state.poses]),
        spread=min(
            _spread([corners_of(pair, side) for pair in pairs], size) for side, size in zip(Side, sizes_px, strict=True)
        ),
        distortion_terms=int(fitted.free[4:].sum()),
    )


def _rig(state: BundleState, sizes_px: Sizes) -> Rig:
    left, right = _model(sizes_px[0], state.left), _model(sizes_px[1], state.right)
    rotation = np.asarray(cv2.Rodrigues(state.rotation)[0], dtype=np.float64)
    return Rig(left=left, right=right, R_right_left=rotation, t_right_left_m=state.translation_m)


def _model(size_px: tuple[int, int], parameters: Vector) -> CameraModel:
    matrix, distortion = camera_arrays(parameters)
    return CameraModel(width_px=size_px[0], height_px=size_px[1], matrix=matrix, distortion=distortion)


def _alone_rms_px(pairs: list[BoardPair], side: Side, points_m: Vector, parameters: Vector) -> float:
    return rms_px(*(own_errors_px(points_m, corners_of(pair, side), parameters) for pair in pairs))


def _vertical_errors_px(pair: BoardPair, rig: Rig, rectification: Rectification) -> Vector:
    left = rectify_points(pair.left_px, rig.left, rectification.R_left, rectification.geometry)
    right = rectify_points(pair.right_px, rig.right, rectification.R_right, rectification.geometry)
    return across_lines_px(left, right, rectification.epipolar)


def _rms(values: Vector) -> float:
    return float(np.sqrt((values**2).mean()))


def _tilt_deg(pose: Vector) -> float:
    """Return the angle between a board and the left image plane."""
    normal_z = abs(float(np.asarray(cv2.Rodrigues(pose[:3])[0])[2, 2]))
    return math.degrees(math.acos(min(normal_z, 1.0)))


def _spread(views: list[Corners], size_px: tuple[int, int]) -> float:
    corners = np.concatenate(views)
    return float((np.ptp(corners, axis=0) / np.array(size_px)).min())
