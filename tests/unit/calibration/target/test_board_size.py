"""The chessboard's size is found in the images; a size that they contradict is refused with the one that they show."""

from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError
from phone_host.calibration.target.board_fits import Fits, side_by_side
from phone_host.calibration.target.board_size import Vote, inner_lattice, require_size, size_in_files, size_seen
from phone_host.calibration.target.corners import Board
from phone_host.stereo.view_files import ViewFiles, pair_files
from tests.support.boards import poses, render_pair
from tests.support.numbered import draw
from tests.support.pictures import encoded
from tests.support.rigs import small_rig

_BOARD = Board(8, 5, 0.028)
_POSES = poses(3, seed=8, depth_m=(0.45, 0.5))


def _files(folder: Path, board: Board) -> ViewFiles:
    for side in ("left", "right"):
        (folder / side).mkdir()
    for index, pose in enumerate(_POSES):
        for side, image in zip(("left", "right"), render_pair(small_rig(), pose, board), strict=True):
            (folder / side / f"{index}.png").write_bytes(encoded(".png", image))
    return pair_files(str(folder / "left"), str(folder / "right"))


def test_the_size_is_that_which_the_images_show(tmp_path: Path) -> None:
    """Any board, either way up, without being told; its own size and its turned size pass, another is refused in one line."""
    files = _files(tmp_path, _BOARD)
    assert size_in_files(files) == (8, 5)
    require_size(files, (8, 5))
    require_size(files, (5, 8))
    with pytest.raises(
        SettingsError, match=r"^these boards have 8x5 inner corners, --board says 9x6: give --board 8x5"
    ):
        require_size(files, (9, 6))
    with pytest.raises(SettingsError, match="have 8x5 inner corners, --board says 6x4"):  # it would fit inside
        require_size(files, (6, 4))


def test_a_board_of_many_squares_is_found_the_other_way(tmp_path: Path) -> None:
    """The usual search ends early in a lattice of 14x10, in each picture elsewhere: then the pictures are asked again."""
    files = _files(tmp_path, Board(14, 10, 0.0155))
    assert size_in_files(files) == (14, 10)
    with pytest.raises(SettingsError, match="have 14x10 inner corners, --board says 13x9"):
        require_size(files, (13, 9))


def _shaded(folder: Path, count: int) -> ViewFiles:
    """Pictures of a board of 8x5 whose last black squares mirror a lamp in their middle, so that only 7x5 corners pass for inner ones."""
    squares = np.kron((np.indices((6, 9)).sum(axis=0) % 2) * 255, np.ones((40, 40)))
    for row in range(6):
        squares[40 * row + 14 : 40 * row + 26, -26:-14] = 255
    image = np.pad(squares, 60, constant_values=255).astype(np.uint8)
    for side in ("left", "right"):
        (folder / side).mkdir()
        for number in range(count):
            (folder / side / f"{number}.png").write_bytes(encoded(".png", np.roll(image, 3 * number, axis=1)))
    return pair_files(str(folder / "left"), str(folder / "right"))


def test_a_part_of_a_board_that_all_images_show_is_not_the_board(tmp_path: Path) -> None:
    """Glare ends the lattice at one row in all of three pairs: the right size fits nevertheless, is found, and is not refused when it is named."""
    files = _shaded(tmp_path, 3)
    assert size_seen(np.asarray(cv2.imread(str(files.pairs[0][1]), 0), np.uint8)) == (7, 5)
    assert size_in_files(files) == (8, 5)
    require_size(files, (8, 5))
    require_size(files, (5, 8))
    for wrong in ((7, 5), (9, 6), (8, 6)):
        with pytest.raises(SettingsError, match="have 8x5 inner corners, --board says"):
            require_size(files, wrong)


def test_the_largest_size_that_fits_is_the_boards() -> None:
    """Parts of a board may fit, too; nothing larger does, nor what no board has; a size that fits one image of three holds not."""
    images = [render_pair(small_rig(), pose, _BOARD)[0] for pose in _POSES]
    fits = Fits(images)
    assert (fits.count((8, 5)), fits.count((9, 6)), fits.count((3, 2)), fits.count((101, 5))) == (3, 0, 0, 0)
    assert fits.grown((7, 4)) == fits.grown((8, 5)) == (8, 5)
    assert fits.shows(_BOARD)
    nothing = np.full_like(images[0], 99)
    assert not Fits([images[0], nothing, nothing]).holds((8, 5))
    assert not Fits([]).holds((8, 5))
    assert Fits([nothing]).grown((7, 4)) == (7, 4)
    assert not Fits([nothing]).shows(_BOARD)
    assert fits.rivals((7, 4), (8, 5)) == (fits.count((7, 4)) > 1)
    assert fits.rivals((8, 5), (8, 5))
    assert not fits.rivals((9, 6), (8, 5))
    assert not Fits([nothing]).rivals((9, 6), (8, 5))


def test_images_without_a_board_name_no_size(tmp_path: Path) -> None:
    """Grey images and files that are no image: a size that was given passes, because nothing contradicts it."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "0.png").write_bytes(encoded(".png", np.full((120, 160), 99, np.uint8)))
        (tmp_path / side / "1.png").write_bytes(b"no image")
    files = pair_files(str(tmp_path / "left"), str(tmp_path / "right"))
    require_size(files, (9, 6))
    with pytest.raises(DataError, match="no chessboard is seen in 4 images: take pictures"):
        size_in_files(files)


def test_files_that_are_no_images_are_named(tmp_path: Path) -> None:
    """Where no file can be read, the first one is the reason, not a missing board."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "0.png").write_text("a text")
    with pytest.raises(DataError, match=r"left/0\.png is no image"):
        size_in_files(pair_files(str(tmp_path / "left"), str(tmp_path / "right")))


def test_a_board_of_marks_is_told_from_a_chessboard(tmp_path: Path) -> None:
    """Where a chessboard is looked for and only coded marks are seen, they are named."""
    made = cv2.aruco.CharucoBoard((7, 5), 0.03, 0.022, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))
    image = cv2.resize(made.generateImage((420, 300), marginSize=20), (640, 480))
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "0.png").write_bytes(encoded(".png", np.asarray(image, np.uint8)))
    with pytest.raises(DataError, match="no chessboard, but marks of the family ArUco 5x5: name that board"):
        size_in_files(pair_files(str(tmp_path / "left"), str(tmp_path / "right")))


def test_a_photograph_is_searched_small() -> None:
    """What is seen does not depend on the image's size: a board of 8 by 5 in an image four times as large."""
    image = render_pair(small_rig(), _POSES[0], _BOARD)[0]
    large = np.asarray(cv2.resize(image, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC), np.uint8)
    assert size_seen(image) == size_seen(large) == (8, 5)
    assert size_seen(np.full((240, 320), 200, np.uint8)) is None


@pytest.mark.parametrize(
    ("sizes", "asked", "leader", "is_over"),
    [
        ({(9, 6): 4}, 6, (9, 6), True),
        ({(9, 6): 25, (5, 3): 9, (7, 3): 4}, 60, (9, 6), True),  # a real rig with a small, dark board
        ({(9, 6): 1, (7, 5): 1}, 6, None, False),  # one vote each
        ({(9, 6): 3, (10, 7): 3, (8, 6): 3}, 12, None, False),  # no agreement
        ({}, 6, None, False),
        ({(9, 6): 1}, 1, (9, 6), False),
    ],
)
def test_the_vote(
    sizes: dict[tuple[int, int], int], asked: int, leader: tuple[int, int] | None, *, is_over: bool
) -> None:
    """Votes count by their corners; one image of many decides nothing."""
    vote = Vote(asked, Counter(sizes))
    assert (vote.leader, vote.is_over) == (leader, is_over)


def test_several_at_a_time_keep_their_order_and_the_first_error_ends_them() -> None:
    """Results come in the order of the things, each is counted, and what one raises is raised."""
    counted: list[int] = []
    assert side_by_side(lambda each: each * each, range(9), lambda: counted.append(1)) == [n * n for n in range(9)]
    assert len(counted) == 9
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda each: 1 // each, [1, 0, 2])


@pytest.mark.parametrize("side", range(4))
def test_corners_of_the_outermost_squares_are_no_inner_corners(side: int) -> None:
    """A detector may take one column too many on any side; what beyond inner corners is cut off by the image's edge stays."""
    squares = np.kron((np.indices((7, 10)).sum(axis=0) % 2) * 255, np.ones((30, 30))).astype(np.uint8)
    image = np.pad(squares, 60, constant_values=255)
    inner = np.asarray(np.stack(np.meshgrid(np.arange(1, 10), np.arange(1, 7)), axis=2) * 30.0 + 59.5, np.float64)
    wide = np.rot90(np.concatenate([inner[:, :1] - [30, 0], inner], axis=1), side)
    found = inner_lattice(image, wide)
    assert found.shape[:2] in {(6, 9), (9, 6)}
    assert inner_lattice(image, inner).shape[:2] == (6, 9)
    cut = image[:, :320]  # in the middle of the last column but one
    assert inner_lattice(cut, inner[:, :8]).shape[:2] == (6, 8)


@pytest.mark.parametrize("number", range(3))
def test_what_is_left_of_a_pattern_may_be_too_little_to_be_a_board(number: int) -> None:
    """Numbers written in black and white blocks make lattices of 3x2 and 2x2 corners at most: that is no board."""
    assert size_seen(draw(number)) is None
