"""The boards tell which side's images are turned or mirrored, and the turn that is named gives a rig at once."""

import itertools

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.calibration.failure_modes.arrangement import Misplaced, composed, misplaced, turned_corners
from phone_host.calibration.failure_modes.remedies import arrangement_hint
from phone_host.calibration.solve.calibrate import Sizes, calibrate
from phone_host.calibration.solve.verdict import Calibration, judge
from phone_host.calibration.target.board_views import BoardViews
from phone_host.calibration.target.corners import Board, Corners, agree
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import Image, Side
from phone_host.stereo.eight_bit import upright
from tests.support.boards import BOARD, poses
from tests.support.rigs import project_points, unlike_rig

_SIZES = ((640, 480), (1280, 720))
_EVEN = Board(8, 6, 0.028)
_SQUARE = Board(6, 6, 0.03)
_TURN = {deg: Orientation(deg, Flip.NONE) for deg in (90, 180, 270)}
_MIRROR = Orientation(0, Flip.H)


def _seen(board: Board) -> list[BoardPair]:
    """Seven boards before a rig, with 0.1 px of noise."""
    rig, random = unlike_rig(), np.random.default_rng(4)
    pairs = []
    for index, pose in enumerate(poses(7, seed=12)):
        points = board.points_m() @ np.asarray(cv2.Rodrigues(pose[:3])[0]).T + pose[3:]
        left, right = (seen + random.normal(0, 0.1, seen.shape) for seen in project_points(points, rig))
        pairs.append(BoardPair(str(index), left, agree(left, right, board)))
    return pairs


def _with(
    pairs: list[BoardPair], sizes_px: Sizes, board: Board, turns: dict[Side, Orientation]
) -> tuple[list[BoardPair], Sizes]:
    """The pairs as a program sees them whose images are turned."""
    changed, sizes = [], list(sizes_px)
    for index, side in enumerate(Side):
        if side in turns:
            sizes[index] = turns[side].turned_size(sizes_px[index])
    for pair in pairs:
        sides: list[Corners] = [pair.left_px, pair.right_px]
        for index, side in enumerate(Side):
            if side in turns:
                sides[index] = turned_corners(sides[index], sizes_px[index], turns[side], board)
        changed.append(BoardPair(pair.name, sides[0], agree(sides[0], sides[1], board)))
    return changed, (sizes[0], sizes[1])


def _calibrated(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> Calibration | DataError:
    try:
        return calibrate(pairs, board, sizes_px)
    except DataError as failure:
        return failure


@pytest.mark.parametrize(
    ("board", "side", "wrong"),
    [
        (BOARD, Side.RIGHT, _TURN[180]),
        (BOARD, Side.LEFT, _TURN[90]),
        (BOARD, Side.LEFT, _MIRROR),
        (_EVEN, Side.RIGHT, _TURN[180]),
        (_EVEN, Side.RIGHT, _MIRROR),
        (_SQUARE, Side.RIGHT, Orientation(90, Flip.H)),
    ],
)
def test_a_turned_or_mirrored_side_is_named_with_the_turn_that_mends_it(
    board: Board, side: Side, wrong: Orientation
) -> None:
    """Whatever a board's colours leave open, the side and its turn are found, and with it the true baseline comes."""
    pairs, sizes = _with(_seen(board), _SIZES, board, {side: wrong})
    found = misplaced(pairs, board, sizes, _calibrated(pairs, board, sizes))
    assert found is not None
    assert (found.side, found.is_either) == (side, False)
    assert composed(wrong, found.turn) == Orientation()
    mended, sizes = _with(pairs, sizes, board, {side: found.turn})
    rig = calibrate(mended, board, sizes).rig
    assert np.linalg.norm(rig.t_right_left_m) == pytest.approx(np.linalg.norm([0.1, 0.004, 0.006]), rel=0.01)


def test_a_side_that_stands_on_its_head_in_a_mirror_may_be_either() -> None:
    """Mirrored top to bottom: the same done to the other side also puts the right camera at the right."""
    pairs, sizes = _with(_seen(BOARD), _SIZES, BOARD, {Side.LEFT: Orientation(180, Flip.H)})
    found = misplaced(pairs, BOARD, sizes, _calibrated(pairs, BOARD, sizes))
    assert found == Misplaced(side=Side.RIGHT, turn=Orientation(180, Flip.H), is_either=True)
    said = arrangement_hint(BoardViews(tuple(pairs), (), sizes), (UPRIGHT, UPRIGHT), found)
    assert "add --flip-right v, or the same for left" in said


@pytest.mark.parametrize(
    ("given", "turn", "said"),
    [
        (UPRIGHT, _TURN[180], "turned by 180 degrees against the left ones: add --rotate-right 180"),
        (_TURN[90], _TURN[90], "add --rotate-right 180"),
        (_TURN[90], _TURN[270], "leave out --rotate-right"),
        (
            _MIRROR,
            _MIRROR,
            "mirrored against the left ones: switch mirroring off in that camera, or leave out --flip-right",
        ),
        (_MIRROR, Orientation(90, Flip.H), "add --rotate-right 270 and leave out --flip-right"),
    ],
)
def test_the_hint_reckons_with_the_options_already_given(given: Orientation, turn: Orientation, said: str) -> None:
    """The options named are those of the next command, not a turn on top of the present ones."""
    views = BoardViews((), (), _SIZES)
    assert said in arrangement_hint(views, (UPRIGHT, given), Misplaced(side=Side.RIGHT, turn=turn))


@pytest.mark.parametrize("both", [_MIRROR, _TURN[180]])
def test_what_the_boards_cannot_tell_is_named_together(both: Orientation) -> None:
    """Two mirrored sides, or two cameras on their heads, look like swapped ones: the remedy names all three causes."""
    pairs, sizes = _with(_seen(BOARD), _SIZES, BOARD, dict.fromkeys(Side, both))
    found = calibrate(pairs, BOARD, sizes)
    assert misplaced(pairs, BOARD, sizes, found) is None
    said = judge(found, ()).remedy
    for cause in ("swap LEFT and RIGHT", "--flip-left h --flip-right h", "--rotate-left 180 --rotate-right 180"):
        assert cause in said


def test_a_good_rig_and_wild_corners_name_no_side() -> None:
    """A rig that fits is left alone, and so are views that no turn explains."""
    pairs = _seen(BOARD)
    assert misplaced(pairs, BOARD, _SIZES, calibrate(pairs, BOARD, _SIZES)) is None
    unlike = [
        BoardPair(one.name, one.left_px, other.right_px)
        for one, other in zip(pairs, pairs[3:] + pairs[:3], strict=True)
    ]
    assert misplaced(unlike, BOARD, _SIZES, _calibrated(unlike, BOARD, _SIZES)) is None
    assert misplaced([], BOARD, _SIZES, DataError("no board", "take more")) is None


def test_two_turns_make_one() -> None:
    """The composed orientation turns pixels as the two do, one after the other."""
    image: Image = np.arange(6, dtype=np.uint8).reshape(2, 3)
    every = [Orientation(deg, flip) for deg in (0, 90, 180, 270) for flip in Flip]
    for first, then in itertools.product(every, every):
        np.testing.assert_array_equal(upright(upright(image, first), then), upright(image, composed(first, then)))


def test_turned_corners_lie_where_the_pixels_do() -> None:
    """A marked pixel of a turned or mirrored image is where the corner is."""
    image: Image = np.zeros((4, 5), np.uint8)
    board = Board(3, 3, 0.02)
    corners = np.array([[1 + x, 0.0 + y] for y in range(3) for x in range(3)])
    image[2, 3] = 255  # the last corner
    for deg, flip in itertools.product((0, 90, 180, 270), (Flip.NONE, Flip.H)):
        turn = Orientation(deg, flip)
        moved = turned_corners(corners, (5, 4), turn, board)
        y, x = np.argwhere(upright(image, turn) == 255)[0]
        assert [x, y] in moved.tolist()
        if flip is Flip.NONE:
            assert [x, y] == moved[-1].tolist()


def test_a_misplaced_side_says_whether_it_is_mirrored() -> None:
    """A turn alone is no mirroring."""
    assert Misplaced(side=Side.LEFT, turn=_MIRROR).is_mirrored
    assert not Misplaced(side=Side.LEFT, turn=_TURN[90]).is_mirrored
