"""The bundle adjustment by itself: from a rough start it finds the rig, and from its own answer it stays there."""

import numpy as np
import pytest

from phone_host.calibration.bundle import BundleState, BundleView, adjust
from phone_host.model import CameraModel
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

SIZES = ((640, 480), (1280, 720))
FREE = np.array([True] * 8 + [False])
"""All but the third radial term."""


def parameters(camera: CameraModel) -> np.ndarray:
    """A camera as the adjustment holds it: fx fy cx cy k1 k2 p1 p2 k3."""
    (fx, _, cx), (_, fy, cy), _ = camera.matrix
    return np.array([fx, fy, cx, cy, *camera.distortion])


def test_an_answer_that_cannot_be_bettered_is_kept() -> None:
    """Restarted from its own answer again and again, the search finds no better one and gives up: the rig of exact corners stays the true one."""
    rig, boards = unlike_rig(), poses(6, seed=2)
    views = [BundleView(pair.left_px, pair.right_px) for pair in exact_pairs(rig, boards)]
    state = BundleState(
        left=parameters(rig.left),
        right=parameters(rig.right),
        rotation=np.array([0.02, -0.05, 0.03]),  # of `unlike_rig`
        translation_m=rig.t_right_left_m,
        poses=boards,
    )
    for _ in range(5):
        found = adjust(views, BOARD.points_m(), state, FREE, SIZES)
        assert found.rms_px() < 1e-5
        np.testing.assert_allclose(found.state.translation_m, rig.t_right_left_m, atol=1e-7)
        state = found.state


def test_the_rig_is_found_from_a_rough_start() -> None:
    """From a focal length 2 % off, the corners are met to their noise, 0.2 px in each coordinate; a second search from that answer moves by less than a micrometre."""
    rig, boards = unlike_rig(), poses(6, seed=2)
    views = [BundleView(pair.left_px, pair.right_px) for pair in exact_pairs(rig, boards, noise_px=0.2, seed=3)]
    rough = BundleState(
        left=parameters(rig.left) * np.array([1.02, 1.02, *[1.0] * 7]),
        right=parameters(rig.right),
        rotation=np.array([0.02, -0.05, 0.03]),
        translation_m=rig.t_right_left_m,
        poses=boards,
    )
    found = adjust(views, BOARD.points_m(), rough, FREE, SIZES)
    assert found.rms_px() == pytest.approx(0.2 * np.sqrt(2), rel=0.15)
    again = adjust(views, BOARD.points_m(), found.state, FREE, SIZES)
    np.testing.assert_allclose(again.state.translation_m, found.state.translation_m, atol=1e-6)
