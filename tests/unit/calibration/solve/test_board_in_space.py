"""A board as a rig sees it in space: rays that miss, its size and its bend, each beside what noise makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.solve.board_in_space import boards_in_space, misses
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import Rig
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import fisheye_rig, project_points, unlike_rig

_NOISE_PX = 0.1


def _moved(rig: Rig, pose: np.ndarray, shift_m: tuple[float, float, float]) -> BoardPair:
    """A board that is shifted in the left camera's axes before the right camera sees it."""
    points = SE3.of(pose).apply(BOARD.points_m())
    return BoardPair("0", project_points(points, rig)[0], project_points(points + np.array(shift_m), rig)[1])


@pytest.mark.parametrize("rig", [unlike_rig(), fisheye_rig()])
def test_a_board_without_noise_is_the_board(rig: Rig) -> None:
    """Exact corners: rays meet, the size is true, nothing is bent."""
    where = poses(3, seed=2)
    for board in boards_in_space(exact_pairs(rig, where), BOARD.points_m(), rig, where, (1.0, 1.0)):
        assert board.miss < 1e-4
        assert board.size == pytest.approx(1.0, abs=1e-5)
        assert np.abs(board.bows_m).max() < 1e-6


def test_stated_uncertainties_are_those_of_the_noise() -> None:
    """Noise of 0.1 px: in 60 views misses are 1, and sizes and bows scatter by their standard deviations."""
    rig, where = unlike_rig(), poses(60, seed=3)
    pairs = exact_pairs(rig, where, _NOISE_PX, seed=4)
    boards = boards_in_space(pairs, BOARD.points_m(), rig, where, (_NOISE_PX, _NOISE_PX))
    sizes = np.array([(each.size - 1) / each.size_sigma for each in boards])
    bows = np.array([each.bows_m / each.bow_sigmas_m for each in boards])
    assert np.mean([each.miss for each in boards]) == pytest.approx(1.0, abs=0.05)
    # The standard deviation of 60 values is known to 9 %.
    assert sizes.std() == pytest.approx(1.0, abs=0.3)
    assert bows.std(axis=0) == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize("angle_deg", [0, 40, 80, 110])
def test_noise_is_alike_in_pixels_at_any_angle_to_the_axis(angle_deg: float) -> None:
    """Two fisheyes of 250 degrees, noise of 0.1 px: rays miss by 1 in the middle, at the edge of the image plane and behind it."""
    camera = fisheye_rig().left
    camera = replace(camera, matrix=np.array([[150.0, 0, 319.5], [0, 150, 239.5], [0, 0, 1]]), distortion=np.zeros(4))
    beside, random = np.array([-0.02, -0.08, 0.01]), np.random.default_rng(5)
    rig = Rig(left=camera, right=camera, R_right_left=np.eye(3), t_right_left_m=beside)
    turn = SE3(rotations_of(np.array([0.0, np.radians(angle_deg), 0.0])), np.zeros(3))
    pairs, where = [], []
    for pose in poses(40, seed=3):
        stands = turn @ SE3.of(pose)
        points = stands.apply(BOARD.points_m())
        seen = [
            project(each, camera) + random.normal(0, _NOISE_PX, (len(points), 2)) for each in (points, points + beside)
        ]
        pairs.append(BoardPair("0", *seen))
        where.append(stands.pose())
    boards = boards_in_space(pairs, BOARD.points_m(), rig, np.array(where), (_NOISE_PX, _NOISE_PX))
    sizes = np.array([(each.size - 1) / each.size_sigma for each in boards])
    assert np.sqrt(np.mean([each.miss**2 for each in boards])) == pytest.approx(1.0, abs=0.06)
    assert sizes.std() == pytest.approx(1.0, abs=0.35)


def test_a_board_that_moves_along_the_baseline_comes_out_larger_or_smaller() -> None:
    """No ray misses another, but depth is that of another disparity: z b / (b - dx), and so is the size."""
    rig, (pose,) = unlike_rig(), poses(1, seed=5)
    centre = -rig.R_right_left.T @ rig.t_right_left_m
    pair = _moved(rig, pose, tuple(0.01 * centre))
    (board,) = boards_in_space([pair], BOARD.points_m(), rig, pose[np.newaxis], (_NOISE_PX, _NOISE_PX))
    assert board.miss < 0.1
    assert board.size == pytest.approx(1 / 0.99, abs=1e-4)
    assert board.size - 1 > 5 * board.size_sigma


def test_a_board_that_moves_across_the_baseline_makes_rays_miss() -> None:
    """1 mm up between the exposures: rays miss by far more than the noise, and more than those of a board that stood still."""
    rig, (pose,) = unlike_rig(), poses(1, seed=5)
    still, moved = (_moved(rig, pose, (0.0, shift, 0.0)) for shift in (0.0, 0.001))
    missed = misses([still, moved], rig, (_NOISE_PX, _NOISE_PX))
    assert missed[0] < 0.01
    assert missed[1] > 3


def test_a_bent_board_is_measured() -> None:
    """Its middle stands out by 3 mm along the rows: that is what is found, and nothing along the columns."""
    rig, where, points = unlike_rig(), poses(2, seed=6), BOARD.points_m()
    halves = np.ptp(points, axis=0) / 2
    bent = points.copy()
    bent[:, 2] += 0.003 * (1 - ((points[:, 0] - points[:, 0].mean()) / halves[0]) ** 2)
    pairs = [BoardPair("0", *project_points(SE3.of(pose).apply(bent), rig)) for pose in where]
    for board in boards_in_space(pairs, points, rig, where, (_NOISE_PX, _NOISE_PX)):
        assert board.bows_m == pytest.approx([0.003, 0.0], abs=1e-5)
        assert board.bow_m[0] == board.bows_m[0]


def test_too_few_corners_tell_nothing() -> None:
    """Eleven corners seen by both: no size and no bend."""
    rig, where = unlike_rig(), poses(1, seed=7)
    (pair,) = exact_pairs(rig, where)
    right = pair.right_px.copy()
    right[11:] = np.nan
    (board,) = boards_in_space([replace(pair, right_px=right)], BOARD.points_m(), rig, where, (1.0, 1.0))
    assert board.miss < 1e-4
    assert np.isnan([board.size, board.size_sigma, *board.bows_m, *board.bow_m]).all()
