"""Squares as a rig measures them: where its rays meet best."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.solve.fitted_rig import square_sides_m
from phone_host.calibration.target.board_names import named_board
from phone_host.model import Rig
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import fisheye_rig, unlike_rig

_SIDES = 9 * 5 + 8 * 6


@pytest.mark.parametrize("rig", [unlike_rig(), fisheye_rig(), unlike_rig((0.004, 0.1, 0.0))])
def test_exact_corners_give_exact_squares(rig: Rig) -> None:
    """Unlike lenses, a fisheye lens, cameras one above the other: each side is 25 mm; one whose corner is not seen is left out."""
    pairs = exact_pairs(rig, poses(3, seed=2))
    left = pairs[1].left_px.copy()
    left[0] = np.nan  # two squares meet in the board's corner
    sides = square_sides_m([pairs[0], replace(pairs[1], left_px=left), pairs[2]], BOARD.points_m(), rig)
    assert len(sides) == 3 * _SIDES - 2
    assert sides == pytest.approx(0.025, rel=1e-5)


def test_rows_that_miss_each_other_are_shared_by_their_noise() -> None:
    """A right image 0.5 px too low, of a camera twice as fine as the left one: the squares stay, and so does their scatter."""
    rig = unlike_rig()
    pairs = [
        replace(pair, right_px=pair.right_px + np.array([0.0, 0.5])) for pair in exact_pairs(rig, poses(4, seed=2))
    ]
    sides = square_sides_m(pairs, BOARD.points_m(), rig)
    assert sides.mean() == pytest.approx(0.025, rel=1e-3)
    assert sides.std() < 0.025 * 2e-3


def test_of_an_aprilgrid_the_tags_are_measured() -> None:
    """Gaps are a quarter as long, so that noise in depth makes them longer by per cents; tags stay within half a per cent."""
    board, random = named_board("aprilgrid:4x3:48mm:12mm", None), np.random.default_rng(3)
    pairs = [
        replace(pair, left_px=pair.left_px + random.normal(0, 0.1, pair.left_px.shape))
        for pair in exact_pairs(unlike_rig(), poses(4, seed=2), board=board)
    ]
    sides = square_sides_m(pairs, board.points_m(), unlike_rig())
    assert len(sides) == 4 * 12 * 4
    assert sides.mean() == pytest.approx(0.048, rel=5e-3)
