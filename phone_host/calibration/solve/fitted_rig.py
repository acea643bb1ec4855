"""A rig fitted to pairs of board views, and what a calibration says of it. Pure."""

import math
from dataclasses import dataclass, replace

import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.bent_board import fit_bent
from phone_host.calibration.solve.board_in_space import boards_in_space
from phone_host.calibration.solve.bundle import BundleResult, BundleView, FreeParameters, Vector, adjust, rig_of, rms_px
from phone_host.calibration.solve.calibrate_alone import corners_of, own_errors_px
from phone_host.calibration.solve.held_out import held_out_squares
from phone_host.calibration.solve.misfits import rms, vertical_errors_px
from phone_host.calibration.solve.next_view import next_view
from phone_host.calibration.solve.result import Calibration, LensTrial, Used
from phone_host.calibration.solve.rig_sigma import DEPTHS_M, depth_sigma_m, zero_sigma_px
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair, Rejected
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Side
from phone_host.stereo.rectify import rectify_rig

Bends = tuple[Bend, Bend]
"""How freely the left and the right lens may bend."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fitted:
    """A rig fitted to the pairs that it explains: the optimum, those pairs, the others, and how freely each lens bent."""

    result: BundleResult
    kept: list[BoardPair]
    rejected: list[Rejected]
    bends: Bends
    free: FreeParameters
    trials: tuple[tuple[LensTrial, ...], tuple[LensTrial, ...]] = ((), ())

    def views(self) -> list[BundleView]:
        """The pairs that are used, as the adjustment takes them."""
        return [BundleView(pair.left_px, pair.right_px) for pair in self.kept]


def summed_up(fitted: Fitted, *, points_m: Vector, board_side: Side) -> Calibration:
    """Make a rig and its figures from the optimum.

    Args:
        fitted: the optimum.
        points_m: (N, 3) corners in the board's axes.
        board_side: which camera is the board's.
    """
    result, pairs, flat_m = fitted.result, fitted.kept, points_m
    boards = boards_in_space(pairs, flat_m, rig_of(result.state), result.state.poses, result.sigmas_px())
    bent = fit_bent(result, flat_m, boards, lambda shape_m, start: adjust(fitted.views(), shape_m, start, fitted.free))
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
