"""What a rig states of itself is what it errs by: corners found far better than the weights of a fit take them for, and right pictures that lie aside as a whole."""

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle import BundleResult, adjust, deviation_px, free_flags, noise_of
from phone_host.calibration.solve.bundle_problem import GLOBALS, Bend, BundleState, RigProblem
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.se3 import vectors_of
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

_FREE = free_flags(Bend.USUAL.free(), Bend.USUAL.free())
_NOISE_PX, _SHIFT_PX, _VIEWS, _SERIES = 0.011, 0.02, 10, 12
"""Live views of rendered rigs: so well are corners found, so far does a hand move between the two exposures."""


def _views(shift_px: float, seed: int, count: int = _VIEWS) -> tuple[list[BoardPair], NDArray[np.float64]]:
    boards, random = poses(count, seed), np.random.default_rng(100 + seed)
    pairs = exact_pairs(unlike_rig(), boards, _NOISE_PX, seed)
    views = [BoardPair(pair.name, pair.left_px, pair.right_px + random.normal(0, shift_px, 2)) for pair in pairs]
    return views, boards


def _true_state(boards: NDArray[np.float64]) -> BundleState:
    rig = unlike_rig()
    turn = vectors_of(rig.R_right_left)
    return BundleState(left=rig.left, right=rig.right, rotation=turn, translation_m=rig.t_right_left_m, poses=boards)


def _found(views: list[BoardPair], boards: NDArray[np.float64]) -> BundleResult:
    return adjust(views, BOARD.points_m(), _true_state(boards), _FREE)


@pytest.mark.parametrize("shift_px", [0.0, _SHIFT_PX])
def test_errors_are_what_is_stated(shift_px: float) -> None:
    """Focal lengths and baselines of twelve series err, root mean square, by 0.55 to 1.25 of the stated standard deviation: neither twice too sure nor twice too careful."""
    rig, shares = unlike_rig(), list[float]()
    for seed in range(_SERIES):
        found = _found(*_views(shift_px, seed))
        sigmas = np.sqrt(np.diag(found.covariance))
        shares += [
            (found.state.left.matrix[0, 0] - rig.left.matrix[0, 0]) / sigmas[0],
            (found.state.right.matrix[0, 0] - rig.right.matrix[0, 0]) / sigmas[12],
            (found.state.translation_m[0] - rig.t_right_left_m[0]) / sigmas[GLOBALS - 3],
        ]
    assert 0.55 < float(np.sqrt(np.mean(np.square(shares)))) < 1.25


def test_noise_and_shift_are_told_apart() -> None:
    """Of 30 views, corners' noise comes back within a tenth, the shift within a third; without a shift next to none is seen."""
    for shift_px in (0.0, _SHIFT_PX):
        views, boards = _views(shift_px, seed=3, count=30)
        found = _found(views, boards)
        problem = _problem(views)
        noise, shift = noise_of(problem, found.state, 20 + 6 * len(views))
        assert noise == pytest.approx((_NOISE_PX, _NOISE_PX), rel=0.1)
        assert shift == pytest.approx(shift_px, abs=_SHIFT_PX / 3)


def test_views_of_one_side_tell_no_shift() -> None:
    """Three views, one of which the right camera did not see: two are too few to tell a shift, and corners that nobody saw count for nothing."""
    views, boards = _views(0.5, seed=1, count=3)
    views[1] = BoardPair("", views[1].left_px, np.full_like(views[1].right_px, np.nan))
    problem = _problem(views)
    assert noise_of(problem, _true_state(boards), 0)[1] == 0.0
    assert deviation_px(np.full(3, np.nan)) == 1.0


def _problem(views: list[BoardPair]) -> RigProblem:
    nothing = np.zeros(GLOBALS)
    return RigProblem(views, BOARD.points_m(), (nothing, nothing), (0.02, 0.02))
