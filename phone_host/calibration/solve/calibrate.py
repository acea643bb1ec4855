"""Calibrates two cameras from pairs of chessboard views: corners in, a rig and its figures out.

A core: corners in, values out; no files. Every pair is used or rejected with its reason.

Order: each camera alone (any size, any lens) -> the relative pose that most pairs agree on -> bundle adjustment of all
(`bundle.py`) -> pairs that do not fit are rejected and the adjustment is repeated until nothing changes. If pairs were
rejected, all of them get a second chance with lenses that bend more freely. At last each camera gets the lens that best
predicts views which it was not fitted to (`lens_choice.py`).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import cv2
import numpy as np

from common.errors import DataError
from common.program.out_of_memory import is_out_of_memory
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle import BundleResult, adjust, free_flags
from phone_host.calibration.solve.bundle_problem import GLOBALS, Bend, BundleState, RigProblem, Vector
from phone_host.calibration.solve.calibrate_alone import (
    LoneCamera,
    calibrate_alone,
    corners_of,
    prediction_errors_px,
    require_enough,
    states_of,
    with_poses,
)
from phone_host.calibration.solve.fitted_rig import Bends, Fitted, misfits, summed_up
from phone_host.calibration.solve.lens_choice import choose_lens, grows, is_fisheye
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.geometry.lens import PARAMETERS, RIG
from phone_host.geometry.schur import Flags
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import CameraModel, Lens, Rig, Side

Sizes = tuple[tuple[int, int], tuple[int, int]]
"""Width and height of the left and of the right images, px."""

# With fewer pairs a richer lens explains wrong pairs. (Of those that fit, `lens_choice` asks views that were held out.)
_FREER_PAIRS = 5
# Real rigs fit to 0.15 to 0.4 px. Above this, lenses that bend more freely are tried even if all pairs were used.
_POOR_PX = 0.6
# Above this share of the image's width no lens is worth choosing: left and right contradict each other.
_HOPELESS_SHARE = 0.01
# By how much the error may grow when rejected pairs come back: a twelfth pair with the same noise changes it by some per
# cent either way, a pair that does not belong by a multiple.
_CHANCE_LOSS = 0.05

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
        DataError: fewer than three pairs are left, or no lens explains them.
    """
    points_m = board.points_m()
    with _unexplained():
        best = _best_fit(pairs, points_m, sizes_px)
        is_hopeless = best.result.rms_px() > _HOPELESS_SHARE * max(size[0] for size in sizes_px)
        fitted = best if is_hopeless else _with_chosen_lenses(best, pairs, points_m, best.bends)
        return summed_up(fitted, points_m=points_m, board_side=board_side)


def fit_rig(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> Fitted:
    """Fit a rig as `calibrate` does, without choosing lenses and without figures.

    Raises:
        DataError: fewer than three pairs are left, or no lens explains them.
    """
    with _unexplained():
        return _best_fit(pairs, board.points_m(), sizes_px)


@contextmanager
def _unexplained() -> Iterator[None]:
    """Name what corners of no board lead to: equations that have no solution."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # on the way; the result is checked
            yield
    except (cv2.error, np.linalg.LinAlgError) as error:
        if is_out_of_memory(error):
            raise
        raise DataError("no lens explains the views", "take new pairs") from error


def _fitted(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes, bends: Bends) -> Fitted:
    """Fit a rig to the pairs, and reject those that do not fit it.

    Raises:
        DataError: fewer than three pairs are left.
    """
    kept, rejected = list(pairs), list[Rejected]()
    alone: list[LoneCamera] = []
    for side, size_px, bend in zip(Side, sizes_px, bends, strict=True):
        kept, out, camera = calibrate_alone(kept, side, points_m, size_px, bend)
        rejected += out
        alone.append(camera)
    left, right = (with_poses(camera, kept, points_m) for camera in alone)
    start, kept, out = _agreed_start(kept, points_m, left, right)
    fitted = _adjust_robustly(kept, points_m, start, bends)
    return replace(fitted, rejected=[*rejected, *out, *fitted.rejected])


def _best_fit(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes) -> Fitted:
    """Fit a rig. If pairs are rejected, judge all of them again with freer lenses; keep those if they explain more pairs, and no worse.

    Raises:
        DataError: fewer than three pairs are left.
    """
    failure: DataError | None = None
    best: Fitted | None = None
    try:
        best = _fitted(pairs, points_m, sizes_px, (Bend.USUAL, Bend.USUAL))
    except DataError as error:
        failure = error
    for bends in _second_chances(pairs, points_m, sizes_px):
        if best is not None and not best.rejected and best.result.rms_px() < _POOR_PX:
            break
        other = _with_freer_lenses(pairs, points_m, sizes_px, bends)
        if other is not None and (best is None or _explains_more(other, best)):
            best = other
    if best is None:
        raise failure or DataError("no lens explains the views", "take new pairs")
    return best


def _second_chances(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes) -> Iterator[Bends]:
    """Yield how freely lenses may bend, after the usual way: both wide, then a fisheye where it explains a camera's views far better, then two."""
    if len(pairs) < _FREER_PAIRS:
        return
    yield Bend.WIDE, Bend.WIDE
    left, right = (
        Bend.FISHEYE if is_fisheye([corners_of(pair, side) for pair in pairs], points_m, size_px) else Bend.USUAL
        for side, size_px in zip(Side, sizes_px, strict=True)
    )
    if Bend.FISHEYE in {left, right}:
        yield left, right
        if left is not right:
            yield Bend.FISHEYE, Bend.FISHEYE


def _explains_more(other: Fitted, best: Fitted) -> bool:
    """Return whether another fit explains more pairs and no worse, or as many and clearly better."""
    error, former = other.result.rms_px(), best.result.rms_px()
    if len(other.kept) == len(best.kept):
        return former > _POOR_PX and error < former / 2
    return len(other.kept) > len(best.kept) and error <= (1 + _CHANCE_LOSS) * former


def _with_freer_lenses(pairs: list[BoardPair], points_m: Vector, sizes_px: Sizes, bends: Bends) -> Fitted | None:
    """Fit a rig with lenses that bend more freely; None if it leads nowhere."""
    try:
        fitted = _fitted(pairs, points_m, sizes_px, bends)
    except (DataError, cv2.error, np.linalg.LinAlgError):  # the richer model may fail where the usual one holds
        return None
    return fitted if _both_grow(fitted.result.state) else None


def _with_chosen_lenses(fitted: Fitted, pairs: list[BoardPair], points_m: Vector, at_least: Bends) -> Fitted:
    """Give each camera the lens that best predicts views which it was not fitted to, and adjust once more."""
    state = fitted.result.state
    relative = SE3(rotations_of(state.rotation), state.translation_m)
    right_poses = np.array([(relative @ SE3.of(pose)).pose() for pose in state.poses])
    found = [
        choose_lens([corners_of(pair, side) for pair in fitted.kept], points_m, model, poses, bend)
        for side, model, poses, bend in zip(
            Side, (state.left, state.right), (state.poses, right_poses), at_least, strict=True
        )
    ]
    bends = (found[0][0].bend, found[1][0].bend)
    fitted = replace(fitted, trials=(tuple(found[0][1]), tuple(found[1][1])))
    if bends == fitted.bends:
        return fitted
    free = free_flags(bends[0].free(), bends[1].free())
    cameras = [
        trial.model if trial.bend is not bend else model
        for (trial, _), bend, model in zip(found, fitted.bends, (state.left, state.right), strict=True)
    ]
    result = adjust(fitted.kept, points_m, replace(state, left=cameras[0], right=cameras[1]), free)
    if not _both_grow(result.state) or result.rms_px() > (1 + _CHANCE_LOSS) * fitted.result.rms_px():
        return fitted
    chosen = replace(fitted, result=result, bends=bends, free=free)
    back = _with_pairs_that_came_back(chosen, pairs, points_m) if fitted.rejected else chosen
    # The pairs that came back may be those that show what the lens is; each turn brings at least one.
    return _with_chosen_lenses(back, pairs, points_m, at_least) if len(back.kept) > len(fitted.kept) else back


def _with_pairs_that_came_back(fitted: Fitted, pairs: list[BoardPair], points_m: Vector) -> Fitted:
    """Judge all pairs anew by lenses that were chosen after some had been rejected; keep that if it explains more of them, and no worse."""
    state = fitted.result.state
    start = replace(state, poses=np.array([fit_pose(points_m, pair.left_px, state.left) for pair in pairs]))
    try:
        again = _adjust_robustly(pairs, points_m, start, fitted.bends)
    except (DataError, cv2.error, np.linalg.LinAlgError):
        return fitted
    again = replace(again, trials=fitted.trials)
    return again if _explains_more(again, fitted) and _both_grow(again.result.state) else fitted


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
    pairs: list[BoardPair], points_m: Vector, start: BundleState, bends: Bends, known: Flags | None = None
) -> Fitted:
    """Adjust, reject the worst pair and adjust again until all fit. With `known`, only what it says is estimated."""
    rejected: list[Rejected] = []
    while True:
        free = free_flags(bends[0].free(), bends[1].free()) if known is None else known
        result = adjust(pairs, points_m, start, free)
        found = misfits(pairs, result, points_m)
        if not found:
            return Fitted(result=result, kept=pairs, rejected=rejected, bends=bends, free=free)
        worst, why = found[0]  # one at a time: the worst pair distorts the errors of the others
        rejected.append(why)
        pairs = [pair for index, pair in enumerate(pairs) if index != worst]
        require_enough(pairs, rejected)
        start = replace(result.state, poses=np.delete(result.state.poses, worst, axis=0))


def _both_grow(state: BundleState) -> bool:
    return grows(state.left) and grows(state.right)


def _fit_of_known_lenses(pairs: list[BoardPair], points_m: Vector, rig: Rig, bends: Bends) -> Fitted:
    """Fit the relative pose alone, and reject pairs that do not fit it."""
    require_enough(pairs, [])
    left, right = (
        with_poses(LoneCamera(side, model, np.empty((0, 6))), pairs, points_m)
        for side, model in ((Side.LEFT, rig.left), (Side.RIGHT, rig.right))
    )
    start, kept, rejected = _agreed_start(pairs, points_m, left, right)
    nothing = np.zeros(PARAMETERS, bool)
    fitted = _adjust_robustly(kept, points_m, start, bends, free_flags(nothing, nothing))
    return replace(fitted, rejected=[*rejected, *fitted.rejected])


def solve_pose(pairs: list[BoardPair], board: Board, earlier: Rig) -> Calibration:
    """Solve the relative pose of two cameras that were moved against each other, and keep their lenses.

    The lenses' uncertainty stays what it was, and is carried on to the new pose: a focal length that is off by a sigma turns and
    shifts the pose that explains the same corners.

    Args:
        pairs: corners of each pair, three or more.
        board: the board.
        earlier: the rig whose lenses are kept, for images of these pairs' size.

    Returns:
        The calibration, with every pair used or rejected.

    Raises:
        DataError: fewer than three pairs are left.
    """
    points_m = board.points_m()
    fitted = _fit_of_known_lenses(pairs, points_m, earlier, (_bend(earlier.left), _bend(earlier.right)))
    covariance = _carried(fitted.result, fitted.kept, points_m, earlier)
    fitted = replace(fitted, result=replace(fitted.result, covariance=covariance))
    return summed_up(fitted, points_m=points_m, board_side=earlier.board_side)


def _bend(model: CameraModel) -> Bend:
    """Return how freely a lens was let bend, as far as its coefficients tell."""
    if model.lens is Lens.FISHEYE:
        return Bend.FISHEYE
    if model.lens is Lens.RATIONAL or model.distortion.size > Bend.WIDE.terms:
        return Bend.RATIONAL
    return Bend.WIDE if model.distortion.size == Bend.WIDE.terms and model.distortion[-1] else Bend.USUAL


def _carried(result: BundleResult, pairs: list[BoardPair], points_m: Vector, earlier: Rig) -> Vector:
    """Return the covariance of lenses and pose together: what the corners leave open of the pose, and what the lenses do."""
    lenses = earlier.covariance[: RIG.start, : RIG.start]
    errors = (result.left_errors_px, result.right_errors_px)
    sigmas = [max(float(np.sqrt(np.nanmean(each**2))), 1e-6) for each in errors]
    problem = RigProblem(pairs, points_m, (np.zeros(GLOBALS), np.zeros(GLOBALS)), (sigmas[0], sigmas[1]))
    whole = problem.linearised(result.state).reduced(0.0, np.ones(GLOBALS, bool))[0]
    by_lens = -np.linalg.solve(whole[RIG, RIG], whole[RIG, : RIG.start])
    covariance = result.covariance.copy()
    covariance[: RIG.start, : RIG.start] = lenses
    covariance[RIG, : RIG.start] = by_lens @ lenses
    covariance[: RIG.start, RIG] = covariance[RIG, : RIG.start].T
    covariance[RIG, RIG] += by_lens @ lenses @ by_lens.T
    return covariance
