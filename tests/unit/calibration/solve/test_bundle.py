"""The bundle adjustment by itself: from a rough start it finds the rig, and from its own answer it stays there."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.solve.bundle import adjust, free_flags
from phone_host.calibration.solve.bundle_problem import Bend, BundleState
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.target.pairs import BoardPair
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

FREE = free_flags(Bend.USUAL.free(), Bend.USUAL.free())
"""All but the third radial term."""


def test_an_answer_that_cannot_be_bettered_is_kept() -> None:
    """Restarted from its own answer again and again, the search finds no better one and gives up: the rig of exact corners stays the true one."""
    rig, boards = unlike_rig(), poses(6, seed=2)
    views = exact_pairs(rig, boards)
    state = BundleState(
        left=rig.left,
        right=rig.right,
        rotation=np.array([0.02, -0.05, 0.03]),  # of `unlike_rig`
        translation_m=rig.t_right_left_m,
        poses=boards,
    )
    for _ in range(5):
        found = adjust(views, BOARD.points_m(), state, FREE)
        assert found.rms_px() < 1e-5
        np.testing.assert_allclose(found.state.translation_m, rig.t_right_left_m, atol=1e-7)
        state = found.state


def test_the_rig_is_found_from_a_rough_start() -> None:
    """From a focal length 2 % off, the corners are met to their noise, 0.2 px in each coordinate; a second search from that answer moves by less than a micrometre."""
    rig, boards = unlike_rig(), poses(6, seed=2)
    views = exact_pairs(rig, boards, noise_px=0.2, seed=3)
    rough = BundleState(
        left=replace(rig.left, matrix=rig.left.matrix * np.array([[1.02, 1, 1], [1, 1.02, 1], [1, 1, 1]])),
        right=rig.right,
        rotation=np.array([0.02, -0.05, 0.03]),
        translation_m=rig.t_right_left_m,
        poses=boards,
    )
    found = adjust(views, BOARD.points_m(), rough, FREE)
    assert found.rms_px() == pytest.approx(0.2 * np.sqrt(2), rel=0.15)
    again = adjust(views, BOARD.points_m(), found.state, FREE)
    np.testing.assert_allclose(again.state.translation_m, found.state.translation_m, atol=1e-6)


def test_corners_that_are_not_seen_are_left_out() -> None:
    """Boards that reach out of one image, with a third of their corners unseen there: the rig comes back all the same, by `adjust` and by `calibrate`."""
    rig, boards = unlike_rig(), poses(9, seed=2)
    for camera in (rig.left, rig.right):
        camera.distortion[4] = 0
    random, pairs = np.random.default_rng(4), list[BoardPair]()
    for pair in exact_pairs(rig, boards):
        left, right = pair.left_px.copy(), pair.right_px.copy()
        left[random.choice(54, 18, replace=False)] = np.nan
        right[random.choice(54, 18, replace=False)] = np.nan
        pairs.append(BoardPair(pair.name, left, right))
    state = BundleState(
        left=rig.left, right=rig.right, rotation=np.array([0.021, -0.05, 0.03]), translation_m=rig.t_right_left_m, poses=boards
    )  # fmt: skip
    found = adjust(pairs, BOARD.points_m(), state, FREE)
    np.testing.assert_allclose(found.state.translation_m, rig.t_right_left_m, atol=1e-6)
    assert np.isnan(found.left_errors_px).sum() == 9 * 18 * 2
    whole = calibrate(pairs, BOARD, ((640, 480), (1280, 720)))
    np.testing.assert_allclose(whole.rig.t_right_left_m, rig.t_right_left_m, atol=1e-5)
    assert len(whole.used) == 9
    assert whole.squares.mean_m == pytest.approx(0.025, rel=1e-5)


def test_five_views_that_contradict_each_other_say_so() -> None:
    """Right corners of a view shift together, as a hand moves between two exposures: what is stated grows by more than their scatter."""
    rig, random = unlike_rig(), np.random.default_rng(7)
    pairs = exact_pairs(rig, poses(5, seed=2), 0.05)
    moved = [replace(pair, right_px=pair.right_px + random.normal(0, 0.3, 2)) for pair in pairs]
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    steady, shifted = (calibrate(each, BOARD, sizes) for each in (pairs, moved))
    scatter = shifted.rig.rms_stereo_px / steady.rig.rms_stereo_px
    assert dict(shifted.depths)[1.0] > 1.5 * scatter * dict(steady.depths)[1.0]
