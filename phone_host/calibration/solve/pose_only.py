"""Solves the relative pose anew and keeps the lenses of an earlier calibration, for cameras that were moved against each other. Pure.

The lenses' uncertainty stays what it was, and is carried on to the new pose: a focal length that is off by a sigma turns and
shifts the pose that explains the same corners.
"""

from dataclasses import replace

import numpy as np

from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.bundle import BundleResult, Vector
from phone_host.calibration.solve.bundle_problem import GLOBALS, BundleView, RigProblem
from phone_host.calibration.solve.calibrate import fit_of_known_lenses
from phone_host.calibration.solve.fitted_rig import summed_up
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.rig_pixels import RIG
from phone_host.model import CameraModel, Lens, Rig


def solve_pose(pairs: list[BoardPair], board: Board, earlier: Rig) -> Calibration:
    """Solve the relative pose of two cameras whose lenses are known.

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
    fitted = fit_of_known_lenses(pairs, points_m, earlier, (_bend(earlier.left), _bend(earlier.right)))
    covariance = _carried(
        fitted.result, [BundleView(pair.left_px, pair.right_px) for pair in fitted.kept], points_m, earlier
    )
    fitted = replace(fitted, result=replace(fitted.result, covariance=covariance))
    return summed_up(fitted, points_m=points_m, board_side=earlier.board_side)


def _bend(model: CameraModel) -> Bend:
    """Return how freely a lens was let bend, as far as its coefficients tell."""
    if model.lens is Lens.FISHEYE:
        return Bend.FISHEYE
    if model.lens is Lens.RATIONAL or model.distortion.size > Bend.WIDE.terms:
        return Bend.RATIONAL
    return Bend.WIDE if model.distortion.size == Bend.WIDE.terms and model.distortion[-1] else Bend.USUAL


def _carried(result: BundleResult, views: list[BundleView], points_m: Vector, earlier: Rig) -> Vector:
    """Return the covariance of lenses and pose together: what the corners leave open of the pose, and what the lenses do."""
    lenses = earlier.covariance[: RIG.start, : RIG.start]
    errors = (result.left_errors_px, result.right_errors_px)
    sigmas = [max(float(np.sqrt(np.nanmean(each**2))), 1e-6) for each in errors]
    problem = RigProblem(views, points_m, (np.zeros(GLOBALS), np.zeros(GLOBALS)), (sigmas[0], sigmas[1]))
    whole = problem.linearised(result.state).reduced(0.0, np.ones(GLOBALS, bool))[0]
    by_lens = -np.linalg.solve(whole[RIG, RIG], whole[RIG, : RIG.start])
    covariance = result.covariance.copy()
    covariance[: RIG.start, : RIG.start] = lenses
    covariance[RIG, : RIG.start] = by_lens @ lenses
    covariance[: RIG.start, RIG] = covariance[RIG, : RIG.start].T
    covariance[RIG, RIG] += by_lens @ lenses @ by_lens.T
    return covariance
