"""The noise of zero: what a calibration says about the disparity of infinitely far points holds for the rigs that calibrations give."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.calibration.bundle import BundleState, BundleView, adjust, globals_of
from phone_host.calibration.calibrate import calibrate
from phone_host.calibration.zero_sigma import zero_sigma_px
from phone_host.model import CameraModel, Rectification, Rig
from phone_host.stereo.rectify import rectify_points, rectify_rig
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import project_points, unlike_rig

_SIZES = ((640, 480), (1280, 720))
_FREE = np.array([1, 1, 1, 1, 1, 1, 1, 1, 0], dtype=bool)
_STARS_M = 1e9
"""So far that 0.1 m of baseline moves nothing by a millionth of a pixel."""


def _state(rig: Rig, board_poses: NDArray[np.float64]) -> BundleState:
    cameras = [
        np.concatenate([[m.matrix[0, 0], m.matrix[1, 1], m.matrix[0, 2], m.matrix[1, 2]], m.distortion])
        for m in (rig.left, rig.right)
    ]
    turn = np.ravel(cv2.Rodrigues(rig.R_right_left)[0]).astype(np.float64)
    return BundleState(
        left=cameras[0], right=cameras[1], rotation=turn, translation_m=rig.t_right_left_m, poses=board_poses
    )


def _rig_of(state: BundleState) -> Rig:
    models = []
    for (width_px, height_px), values in zip(_SIZES, (state.left, state.right), strict=True):
        matrix = np.array([[values[0], 0, values[2]], [0, values[1], values[3]], [0, 0, 1]])
        models.append(CameraModel(width_px=width_px, height_px=height_px, matrix=matrix, distortion=values[4:]))
    rotation = np.asarray(cv2.Rodrigues(state.rotation)[0], np.float64)
    return Rig(left=models[0], right=models[1], R_right_left=rotation, t_right_left_m=state.translation_m)


def _disparity_of_stars_px(truth: Rig, rig: Rig, rectification: Rectification) -> float:
    """Root mean square disparity that this rig gives to points at infinity, seen by the true cameras."""
    geometry = rectification.geometry
    x, y = np.meshgrid(
        np.linspace(20, rectification.width_px - 20, 8), np.linspace(20, rectification.height_px - 20, 6)
    )
    rays = np.column_stack([x.ravel() - geometry.cx_px, y.ravel() - geometry.cy_px, np.full(x.size, geometry.focal_px)])
    left, right = project_points(rays @ rectification.R_left * _STARS_M, truth)
    left = rectify_points(left, rig.left, rectification.R_left, geometry)
    right = rectify_points(right, rig.right, rectification.R_right, geometry)
    return float(np.sqrt(((left - right)[:, 0] ** 2).mean()))


def test_the_stated_sigma_is_that_of_many_calibrations() -> None:
    """Of 24 calibrations from boards at other places with other noise, the errors match what each says of itself, within a factor of 1.5."""
    truth, shares = unlike_rig(), []
    for seed in range(24):
        board_poses = poses(10, seed)
        pairs = exact_pairs(truth, board_poses, noise_px=0.2, seed=seed)
        views = [BundleView(pair.left_px, pair.right_px) for pair in pairs]
        result = adjust(views, BOARD.points_m(), _state(truth, board_poses), _FREE, _SIZES)
        rig = _rig_of(result.state)
        rectification = rectify_rig(rig)
        stated = zero_sigma_px(result.covariance, globals_of(result.state), rig, rectification)
        shares.append(_disparity_of_stars_px(truth, rig, rectification) / stated)
    assert 1 / 1.5 < np.sqrt(np.mean(np.square(shares))) < 1.5


def test_more_noise_leaves_zero_less_certain() -> None:
    """Twice the noise of the corners gives about twice the sigma; a calibration stores it in its rig."""
    sigmas = [
        calibrate(exact_pairs(unlike_rig(), poses(10, seed=4), noise_px, seed=1), BOARD, _SIZES).rig.zero_sigma_px
        for noise_px in (0.1, 0.2)
    ]
    assert sigmas[1] / sigmas[0] == pytest.approx(2.0, rel=0.2)


def test_a_covariance_that_is_not_finite_says_nothing() -> None:
    """NaN is no measurement."""
    rig = unlike_rig()
    state = _state(rig, poses(3, seed=1))
    unknown = np.full((24, 24), np.nan)
    assert np.isnan(zero_sigma_px(unknown, globals_of(state), rig, rectify_rig(rig)))
