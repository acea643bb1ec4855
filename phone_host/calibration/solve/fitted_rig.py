"""A rig fitted to pairs of board views: pairs that do not fit, and what a calibration says of it. Pure.

Squares are measured on boards that the rig has not seen: they are dealt out in parts, each measured by a rig fitted to the others. So an
error that a rig makes everywhere, of scale or of depth, shows in millimetres, while the rows of a rig fitted to the same views may still meet.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.solve.board_in_space import boards_in_space, fit_bent, misses, ray_crossings
from phone_host.calibration.solve.bundle import BundleResult, adjust, adjust_roughly, rig_of, rms_px
from phone_host.calibration.solve.bundle_problem import Bend, BundleState, Vector
from phone_host.calibration.solve.calibrate_alone import FAR_OFF_PX, corners_of, off_words, own_errors_px
from phone_host.calibration.solve.next_view import DEPTHS_M, depth_sigma_m, next_view, zero_sigma_px
from phone_host.calibration.solve.verdict import Calibration, LensTrial, Squares, Used
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.geometry.schur import Flags
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Rectification, Rig, Side
from phone_host.stereo.rectify import across_lines_px, rectify_points, rectify_rig

# A pair is rejected when its error is twice the median pair's, but never below this floor: smaller errors do no harm.
_OUTLIER_FACTOR, _OUTLIER_FLOOR_PX = 2.0, 0.3
# Lenses bend as little as few pairs allow, which one pair shows more than another: less than this many need an error of three times the median pair's.
_FEW_PAIRS, _FEW_FACTOR = 8, 3.0
# By how much rays miss each other carries a quarter of the information and scatters more from pair to pair. Rows that differ by
# 0.3 px are brought together by moving both corners by half of that.
_RAYS_FACTOR, _RAYS_FLOOR_PX = 2.5, 0.3 / 2**0.5

_PARTS: Final = 5
_LEAST_PAIRS: Final = 6
_NEIGHBOUR: Final = 0.01
"""Corners whose distance is a side, up to this share, span one."""

Bends = tuple[Bend, Bend]
"""How freely the left and the right lens may bend."""


def misfits(pairs: list[BoardPair], result: BundleResult, points_m: Vector) -> list[tuple[int, Rejected]]:
    """Find pairs that fit much worse than the others, worst first: by reprojection error, or by rays that miss each other."""
    errors = np.fmax(*result.view_rms_px())
    usual = float(np.median(errors))
    factor = _FEW_FACTOR if len(pairs) < _FEW_PAIRS else _OUTLIER_FACTOR
    by_error = errors / max(factor * usual, _OUTLIER_FLOOR_PX)
    found = [
        (
            by_error[index],
            index,
            _misfit(pairs[index], result.state, points_m, error_px=float(errors[index]), usual_px=usual),
        )
        for index in np.flatnonzero(by_error > 1)
    ]
    missed = misses(pairs, rig_of(result.state))
    crossing = missed[np.isfinite(missed)]  # NaN: the cameras see no corner of that pair in common
    usual = float(np.median(crossing)) if crossing.size else math.nan
    by_rays = missed / max(_RAYS_FACTOR * usual, _RAYS_FLOOR_PX)
    found += [
        (
            by_rays[index],
            index,
            Rejected(
                pairs[index].name,
                Reason.MOVED,
                f"rays of left and right miss each other by {missed[index]:.2f} px, others by {usual:.2f} px: board or"
                " cameras moved between the two exposures",
            ),
        )
        for index in np.flatnonzero(by_rays > 1)
    ]
    return [(int(index), why) for _, index, why in sorted(found, key=lambda each: -each[0])]


def _misfit(pair: BoardPair, state: BundleState, points_m: Vector, *, error_px: float, usual_px: float) -> Rejected:
    """Say why a pair does not fit: fitting each view alone shows whether corners jump or the board moved."""
    own = {
        side: rms_px(own_errors_px(points_m, corners_of(pair, side), camera))
        for side, camera in ((Side.LEFT, state.left), (Side.RIGHT, state.right))
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


def vertical_errors_px(pair: BoardPair, rig: Rig, rectification: Rectification) -> Vector:
    """Return (M,) how far the M corners that both cameras see lie beside each other's row after rectification, px."""
    seen = np.isfinite(pair.left_px).all(axis=1) & np.isfinite(pair.right_px).all(axis=1)
    left = rectify_points(pair.left_px[seen], rig.left, rectification.R_left, rectification.geometry)
    right = rectify_points(pair.right_px[seen], rig.right, rectification.R_right, rectification.geometry)
    return across_lines_px(left, right, rectification.epipolar)


def rms(values: Vector) -> float:
    """Return the root mean square of values; NaN if there are none."""
    return float(np.sqrt((values**2).mean())) if values.size else float("nan")


def held_out_squares(pairs: list[BoardPair], points_m: Vector, state: BundleState, free: Flags) -> Squares:
    """Measure the squares of every pair by a rig that has not seen it."""
    true_m = _side_m(points_m)
    sides: list[Vector] = []
    parts = min(_PARTS, len(pairs)) if len(pairs) >= _LEAST_PAIRS else 0
    for part in range(parts):
        out = np.arange(len(pairs)) % parts == part
        kept = [pair for pair, is_held in zip(pairs, out, strict=True) if not is_held]
        rig = rig_of(adjust_roughly(kept, points_m, replace(state, poses=state.poses[~out]), free))
        held = [pair for pair, is_held in zip(pairs, out, strict=True) if is_held]
        sides.append(square_sides_m(held, points_m, rig))
    found = np.concatenate(sides) if sides else np.empty(0)
    if not found.size:
        return Squares(true_m=true_m, mean_m=float("nan"), sigma_m=float("nan"), count=0)
    return Squares(true_m=true_m, mean_m=float(found.mean()), sigma_m=float(found.std()), count=found.size)


def square_sides_m(pairs: list[BoardPair], points_m: Vector, rig: Rig) -> Vector:
    """Return the sides of the squares between neighbouring corners, (M,) m, as a rig measures them: where its rays meet best."""
    points = ray_crossings(pairs, rig).points_m.reshape(len(pairs), -1, 3)
    first, second = _neighbours(points_m)
    sides = np.linalg.norm(points[:, first] - points[:, second], axis=2)
    return np.asarray(sides[np.isfinite(sides)], np.float64)


def _side_m(points_m: Vector) -> float:
    """Return the side of a square, or of an AprilGrid's tag: its gaps are so narrow that noise makes them longer."""
    return float(np.linalg.norm(points_m[1] - points_m[0]))


def _neighbours(points_m: Vector) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    apart, side_m = np.linalg.norm(points_m[:, np.newaxis] - points_m[np.newaxis], axis=2), _side_m(points_m)
    first, second = np.nonzero(np.triu(np.abs(apart - side_m) <= side_m * _NEIGHBOUR, 1))
    return first, second


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fitted:
    """A rig fitted to the pairs that it explains: the optimum, those pairs, the others, and how freely each lens bent."""

    result: BundleResult
    kept: list[BoardPair]
    rejected: list[Rejected]
    bends: Bends
    free: Flags
    trials: tuple[tuple[LensTrial, ...], tuple[LensTrial, ...]] = ((), ())


def summed_up(fitted: Fitted, *, points_m: Vector, board_side: Side) -> Calibration:
    """Make a rig and its figures from the optimum."""
    result, pairs, flat_m = fitted.result, fitted.kept, points_m
    boards = boards_in_space(pairs, flat_m, rig_of(result.state), result.state.poses, result.sigmas_px())
    bent = fit_bent(result, flat_m, boards, lambda shape_m, start: adjust(fitted.kept, shape_m, start, fitted.free))
    if bent is not None:
        result, points_m = bent.result, bent.points_m
        boards = boards_in_space(pairs, flat_m, rig_of(result.state), result.state.poses, result.sigmas_px())
    state = result.state
    rig = replace(
        rig_of(state),
        covariance=result.covariance,
        board_side=board_side,
        rms_left_px=_alone_rms_px(pairs, Side.LEFT, points_m, state.left),
        rms_right_px=_alone_rms_px(pairs, Side.RIGHT, points_m, state.right),
        rms_stereo_px=result.rms_px(),
    )
    rectification, obstacle, advice = None, None, None
    vertical = [np.full(1, np.nan)] * len(pairs)
    depths: tuple[tuple[float, float], ...] = ()
    try:
        rectification = rectify_rig(rig)
    except DataError as error:
        obstacle = error
    else:
        vertical = [vertical_errors_px(pair, rig, rectification) for pair in pairs]
        rig = replace(rig, zero_sigma_px=zero_sigma_px(rig, rectification))
        depths = tuple((depth_m, depth_sigma_m(rig, rectification, depth_m)) for depth_m in DEPTHS_M)
        advice = next_view(result, fitted.free, points_m, rectification)
    used = tuple(
        Used(name=pair.name, left_px=float(a), right_px=float(b), vertical_px=rms(v), in_space=board)
        for pair, a, b, v, board in zip(pairs, *result.view_rms_px(), vertical, boards, strict=True)
    )
    return Calibration(
        rig=rig,
        rectification=rectification,
        obstacle=obstacle,
        used=used,
        rejected=tuple(fitted.rejected),
        vertical_px=np.abs(np.concatenate(vertical)),
        baseline_sigma_m=rig.baseline_sigma_m,
        tilts_deg=np.array([_tilt_deg(pose) for pose in state.poses]),
        spread=min(
            _spread([corners_of(pair, side) for pair in pairs], (model.width_px, model.height_px))
            for side, model in ((Side.LEFT, state.left), (Side.RIGHT, state.right))
        ),
        bends=fitted.bends,
        squares=held_out_squares(pairs, points_m, state, fitted.free),
        depths=depths,
        advice=advice,
        trials=fitted.trials,
        poses=state.poses,
        left_errors_px=result.left_errors_px,
        right_errors_px=result.right_errors_px,
    )


def _alone_rms_px(pairs: list[BoardPair], side: Side, points_m: Vector, model: CameraModel) -> float:
    return rms_px(*(own_errors_px(points_m, corners_of(pair, side), model) for pair in pairs))


def _tilt_deg(pose: Vector) -> float:
    """Return the angle between a board and the left image plane."""
    normal_z = abs(float(rotations_of(pose[:3])[2, 2]))
    return math.degrees(math.acos(min(normal_z, 1.0)))


def _spread(views: list[Corners], size_px: tuple[int, int]) -> float:
    corners = np.concatenate(views)
    return float(((np.nanmax(corners, axis=0) - np.nanmin(corners, axis=0)) / np.array(size_px)).min())
