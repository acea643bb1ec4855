"""What the novice of the live guide's benchmark is worth: its pictures are right, its hands move smoothly, it does what it hears."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.guide.coverage import placement
from phone_host.calibration.target.board_size import size_seen, whole_size_seen
from phone_host.calibration.target.corners import find_corners
from phone_host.geometry.lens import project
from tests.support.novice.depth_truth import depth_error_m, depths_in_places
from tests.support.novice.hands import Plan, Stroke, motion
from tests.support.novice.head import Novice
from tests.support.novice.painter import Moment, Painter
from tests.support.novice.scene import BOARD, board_of, novice_scene

MIDDLE_M = BOARD.points_m().mean(axis=0)


@pytest.mark.parametrize("turned", [0.0, 0.35])
def test_painted_corners_lie_where_the_lens_puts_them(turned: float) -> None:
    """Corners found in a picture with noise and blur lie where geometry puts them: 0.04 px rms, hardly more than the detector's own error."""
    eye = novice_scene(1).left
    pose = motion(np.array([0.02, 0.01, 0.42, -turned, turned, 0.02]), MIDDLE_M)
    image = Painter(eye, BOARD, 1).paint((Moment(pose), Moment(pose)))
    off = find_corners(image, BOARD) - project(pose.apply(BOARD.points_m()), eye.model)
    assert float(np.sqrt((off**2).mean())) < 0.04
    assert float(np.abs(off.mean(axis=0)).max()) < 0.01


@pytest.mark.parametrize("kind", ["charuco", "aprilgrid"])
def test_painted_boards_with_marks_are_seen_in_part(kind: str) -> None:
    """Half outside the image, the corners that are left lie where geometry puts them; the others are not seen."""
    board, eye = board_of(kind), novice_scene(1).left
    middle_m = board.points_m().mean(axis=0)
    pose = motion(np.array([0.19, 0.01, 0.4, -0.2, 0.2, 0.02]), middle_m)
    image = Painter(eye, board, 1).paint((Moment(pose), Moment(pose)))
    off = find_corners(image, board) - project(pose.apply(board.points_m()), eye.model)
    seen = np.isfinite(off).all(axis=1)
    assert 0.3 < seen.mean() < 0.9
    assert float(np.sqrt((off[seen] ** 2).mean())) < 0.04
    placed = placement(find_corners(image, board), board, eye.model)
    assert placed.reach(1, 1) > 0.2
    assert placed.reach(-1, -1) < 0
    assert len(placed.outline) < 4


def test_a_moving_board_is_blurred() -> None:
    """The picture of a board that moves by 12 px while the shutter is open has softer edges along the way than across it."""
    eye = novice_scene(1).left
    way_m = 12 * 0.42 / eye.model.matrix[0, 0]
    painter = Painter(eye, BOARD, 1)
    poses = [motion(np.array([x, 0.01, 0.42, 0, 0, 0]), MIDDLE_M) for x in np.linspace(0, way_m, 6)]
    assert painter.moments_for(poses[0], poses[-1]) == len(poses)
    image = painter.paint(tuple(Moment(pose) for pose in poses)).astype(float)[180:300, 240:400]
    along, across = (float(np.abs(np.diff(image, axis=axis)).max()) for axis in (1, 0))
    assert along < across / 2


def test_a_shorter_plan_is_the_same() -> None:
    """Strokes that are over count as one; the pose stays what it was, and the grip."""
    strokes = [Stroke(float(k), 0.7, np.full(6, k + 1.0), k % 3) for k in range(6)]
    plan = Plan(tuple(strokes))
    shorter = plan.since(3.2)
    assert len(shorter.strokes) == 4
    for at_s in np.linspace(3.2, 8, 20):
        assert np.allclose(shorter.at(at_s), plan.at(at_s))
        assert shorter.grip(at_s) == plan.grip(at_s)


@pytest.mark.parametrize(
    ("words", "component", "sign"),
    [
        ("left edge", 0, -1),
        ("bottom right corner", 1, 1),
        ("closer", 2, -1),
        ("farther away", 2, 1),
        ("tilt the board: top edge away", 3, -1),
        ("tilt the board: left edge away", 4, 1),
    ],
)
def test_the_novice_does_what_it_hears(words: str, component: int, sign: int) -> None:
    """Told for ten seconds, somebody who mistakes no direction has moved the board that way, not before a reaction time."""
    novice = Novice(np.random.default_rng(3), np.array([0.05, 0, 0]), 0.0)
    novice.person = replace(novice.person, mistakes=0.0, bored_s=1e9)
    novice.plan = Plan((Stroke(-10, 1, np.array([0.05, 0, 0.5, 0, 0, 0])),))
    novice.bored_at_s = np.inf
    before = novice.plan.at(0.0)
    novice.hear(words, 0.0)
    assert not novice.act(0.39)
    for at_s in np.arange(0.4, 10, 0.02):
        novice.act(float(at_s))
    assert sign * (novice.plan.at(10.0) - before)[component] > 0.05


def test_a_perfect_rig_measures_exactly() -> None:
    """The depth error of the truth is nothing; one of a baseline that is 1 % too long is 1 % of the depth."""
    rig = novice_scene(2).rig
    assert depth_error_m(rig, rig, 1.0) < 1e-6
    assert depth_error_m(replace(rig, t_right_left_m=rig.t_right_left_m * 1.01), rig, 1.0) == pytest.approx(
        0.01, rel=1e-3
    )


def test_what_a_rig_states_in_the_corners_follows_from_its_covariance() -> None:
    """A baseline that is known to 1 % gives depths at 1 m that are known to 10 mm everywhere, and one that is 1 % too long, that error."""
    rig = novice_scene(2).rig
    shift_m = rig.t_right_left_m * 0.01
    covariance = np.zeros((30, 30))
    covariance[-3:, -3:] = np.outer(shift_m, shift_m)
    found = replace(rig, t_right_left_m=rig.t_right_left_m + shift_m, covariance=covariance)
    places = depths_in_places(found, rig, 1.0)
    assert len(places) == 5
    for error_m, sigma_m in places:
        assert error_m == pytest.approx(0.01, rel=1e-3)
        assert sigma_m == pytest.approx(0.01, rel=0.02)


@pytest.mark.parametrize(
    ("aside_m", "grip", "part", "whole"),
    [(0.0, 0, (9, 6), (9, 6)), (0.18, 0, (7, 6), None), (0.0, 1, (8, 6), None)],
    ids=["whole", "half outside", "held over squares"],
)
def test_a_part_of_a_board_is_no_smaller_board(
    aside_m: float, grip: int, part: tuple[int, int], whole: tuple[int, int] | None
) -> None:
    """A board beyond the image's edge, or under a hand, looks like a smaller one; its size counts only with its margin on all sides."""
    pose = motion(np.array([aside_m, 0.02, 0.42, 0.1, 0.1, 0]), MIDDLE_M)
    image = Painter(novice_scene(1).left, BOARD, 1).paint((Moment(pose, grip),) * 2)
    assert size_seen(image) == part
    assert whole_size_seen(image) == whole
