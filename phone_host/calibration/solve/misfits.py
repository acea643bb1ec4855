"""Finds pairs that do not fit the others, and says why. Pure."""

import math

import numpy as np

from phone_host.calibration.solve.board_in_space import misses
from phone_host.calibration.solve.bundle import BundleResult, BundleState, Vector, rig_of, rms_px
from phone_host.calibration.solve.calibrate_alone import FAR_OFF_PX, corners_of, off_words, own_errors_px
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.model import Rectification, Rig, Side
from phone_host.stereo.rectify import across_lines_px, rectify_points

# A pair is rejected when its error is twice the median pair's, but never below this floor: smaller errors do no harm.
_OUTLIER_FACTOR, _OUTLIER_FLOOR_PX = 2.0, 0.3
# Lenses bend as little as few pairs allow, which one pair shows more than another: less than this many need an error of three times the median pair's.
_FEW_PAIRS, _FEW_FACTOR = 8, 3.0
# By how much rays miss each other carries a quarter of the information and scatters more from pair to pair. Rows that differ by
# 0.3 px are brought together by moving both corners by half of that.
_RAYS_FACTOR, _RAYS_FLOOR_PX = 2.5, 0.3 / 2**0.5


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
