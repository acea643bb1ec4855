"""The noise of zero: what a calibration says about the disparity of infinitely far points holds for the rigs that calibrations give."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle import adjust, free_flags, rig_of
from phone_host.calibration.solve.bundle_problem import Bend, BundleState
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.next_view import depth_sigma_m, zero_sigma_px
from phone_host.model import Rectification, Rig
from phone_host.stereo.rectify import rectify_points, rectify_rig
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import project_points, unlike_rig

_SIZES = ((640, 480), (1280, 720))
_FREE = free_flags(Bend.USUAL.free(), Bend.USUAL.free())
_STARS_M = 1e9
"""So far that 0.1 m of baseline moves nothing by a millionth of a pixel."""


def _state(rig: Rig, board_poses: NDArray[np.float64]) -> BundleState:
    turn = np.ravel(cv2.Rodrigues(rig.R_right_left)[0]).astype(np.float64)
    return BundleState(
        left=rig.left, right=rig.right, rotation=turn, translation_m=rig.t_right_left_m, poses=board_poses
    )


def _disparities_px(
    truth: Rig, rig: Rig, rectification: Rectification, depth_m: float = _STARS_M
) -> NDArray[np.float64]:
    """Disparities that this rig gives to points at a depth in its rectified axes, seen by the true cameras."""
    geometry = rectification.geometry
    x, y = np.meshgrid(
        np.linspace(20, rectification.width_px - 20, 8), np.linspace(20, rectification.height_px - 20, 6)
    )
    rays = np.column_stack([x.ravel() - geometry.cx_px, y.ravel() - geometry.cy_px, np.full(x.size, geometry.focal_px)])
    left, right = project_points(rays @ rectification.R_left * depth_m / geometry.focal_px, truth)
    left = rectify_points(left, rig.left, rectification.R_left, geometry)
    right = rectify_points(right, rig.right, rectification.R_right, geometry)
    return np.asarray((left - right)[:, 0], np.float64)


def test_the_stated_sigmas_are_those_of_many_calibrations() -> None:
    """Of 30 calibrations from boards at other places with other noise, the errors of zero and of depth match what each says of itself, within a factor of 1.5."""
    truth, shares, depths_m = unlike_rig(), list[list[float]](), (0.5, 1.0)
    for seed in range(30):
        board_poses = poses(10, seed)
        pairs = exact_pairs(truth, board_poses, noise_px=0.2, seed=seed)
        views = pairs
        result = adjust(views, BOARD.points_m(), _state(truth, board_poses), _FREE)
        rig = replace(rig_of(result.state), covariance=result.covariance)
        rectification = rectify_rig(rig)
        geometry = rectification.geometry
        zero = _disparities_px(truth, rig, rectification)
        shares.append([float(np.sqrt((zero**2).mean())) / zero_sigma_px(rig, rectification)])
        for depth_m in depths_m:
            measured_m = geometry.focal_px * geometry.baseline_m / _disparities_px(truth, rig, rectification, depth_m)
            off_m = float(np.sqrt(((measured_m - depth_m) ** 2).mean()))
            shares[-1].append(off_m / depth_sigma_m(rig, rectification, depth_m))
    together = np.sqrt(np.mean(np.square(shares), axis=0))
    assert ((together > 1 / 1.5) & (together < 1.5)).all(), together


def test_more_noise_leaves_zero_less_certain() -> None:
    """Twice the noise of the corners gives about twice the sigma; a calibration stores it in its rig."""
    sigmas = [
        calibrate(exact_pairs(unlike_rig(), poses(10, seed=4), noise_px, seed=1), BOARD, _SIZES).rig.zero_sigma_px
        for noise_px in (0.1, 0.2)
    ]
    assert sigmas[1] / sigmas[0] == pytest.approx(2.0, rel=0.2)


def test_a_covariance_that_is_not_known_says_nothing() -> None:
    """NaN is no measurement."""
    rig = unlike_rig()
    assert np.isnan(zero_sigma_px(rig, rectify_rig(rig)))
    assert np.isnan(depth_sigma_m(rig, rectify_rig(rig), 1.0))
