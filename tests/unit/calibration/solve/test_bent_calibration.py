"""A board that is bent does not bend the rig: its bend is estimated along with it."""

import numpy as np
import pytest

from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.se3 import SE3
from tests.support.boards import BOARD, poses
from tests.support.rigs import project_points, unlike_rig

_NOISE_PX = 0.1


@pytest.mark.parametrize("bow_m", [0.001, 0.004])
def test_a_bend_leaves_the_rig_within_what_is_stated(bow_m: float) -> None:
    """Middle of 200 mm standing out by 1 and 4 mm: bow, focal lengths and baseline lie within three of their standard deviations, and focal length within 0.3 %.

    A rig fitted to a flat board is off by ten times as much.
    """
    rig, random, points = unlike_rig(), np.random.default_rng(11), BOARD.points_m()
    bent = points.copy()
    bent[:, 2] += bow_m * (1 - (2 * (points[:, 0] - points[:, 0].mean()) / np.ptp(points[:, 0])) ** 2)
    pairs = []
    for index, pose in enumerate(poses(12, seed=8)):
        seen = project_points(SE3.of(pose).apply(bent), rig)
        pairs.append(BoardPair(str(index), *(each + random.normal(0, _NOISE_PX, each.shape) for each in seen)))
    found = calibrate(pairs, BOARD, ((640, 480), (1280, 720)))
    assert len(found.used) == 12
    bows = np.array([used.in_space.bows_m[0] for used in found.used])
    assert bows.mean() == pytest.approx(bow_m, abs=1.5e-4)
    sigmas = np.sqrt(np.diag(found.rig.covariance))
    for model, truth, sigma in ((found.rig.left, rig.left, sigmas[0]), (found.rig.right, rig.right, sigmas[12])):
        error = model.matrix[0, 0] - truth.matrix[0, 0]
        assert abs(error) < 3 * sigma
        assert abs(error) < 0.003 * truth.matrix[0, 0]
    baselines = [float(np.linalg.norm(each.t_right_left_m)) for each in (found.rig, rig)]
    assert abs(baselines[0] - baselines[1]) < 3 * found.baseline_sigma_m
