"""The chessboard: parsing its size, finding it, and the order of its corners."""

import cv2
import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.calibration.target.corners import Board, agree, find_corners, order_by_colour, parse_board
from phone_host.jobs.units import square_mm
from tests.support.boards import BOARD, poses, render_pair
from tests.support.rigs import project_points, unlike_rig


@pytest.mark.parametrize("square", ["25mm", "2.5cm", "0.025m", "25", " 25 mm ", "25MM"])
def test_lengths_are_read_with_their_unit(square: str) -> None:
    """All ways to write 25 mm give 0.025 m; a bare number means millimetres."""
    board = parse_board("9x6", square_mm(square))
    assert (board.columns, board.rows) == (9, 6)
    assert board.square_m == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("corners", "square", "option"),
    [("9", "25mm", "--board"), ("9x", "25mm", "--board"), ("2x6", "25mm", "--board"), ("9x6", "25in", "--square"),
     ("9x6", "0mm", "--square"), ("9x6", "0.025", "--square"), ("9x6", "-25mm", "--square"), ("9x6", "5m", "--square"), ("9x6", "nan", "--square")],
)  # fmt: skip
def test_sizes_that_make_no_sense_name_their_option(corners: str, square: str, option: str) -> None:
    """A wrong size is a usage error that names the option."""
    with pytest.raises(SettingsError, match=option):
        parse_board(corners, square_mm(square))


def test_points_run_along_rows_in_metres() -> None:
    """The second point is one square to the right, and the first of the next row is one square down."""
    points = BOARD.points_m()
    assert points.shape == (54, 3)
    np.testing.assert_allclose(points[1], [0.025, 0, 0])
    np.testing.assert_allclose(points[9], [0, 0.025, 0])


def test_corners_of_a_rendered_board_are_where_geometry_puts_them() -> None:
    """In both cameras' images corners are found within 0.25 px (root mean square) of their projection, none off by 0.5 px, in order."""
    rig = unlike_rig()
    for pose in poses(3, seed=3):
        from_pose = _corners_m(pose)
        expected = project_points(from_pose, rig)
        for image, truth in zip(render_pair(rig, pose), expected, strict=True):
            found = find_corners(image, BOARD)
            assert found.shape == (54, 2)
            # The board's first inner square is black here, so its white-first order is rotated by 180 degrees.
            errors = np.linalg.norm(found[::-1] - truth, axis=1)
            assert np.sqrt((errors**2).mean()) < 0.25  # without lens blur edges alias
            assert errors.max() < 0.5


def _corners_m(pose: np.ndarray) -> np.ndarray:
    points: np.ndarray = BOARD.points_m() @ np.asarray(cv2.Rodrigues(pose[:3])[0]).T + pose[3:]
    return points


def test_an_image_on_its_head_gives_the_same_corner_first() -> None:
    """A 9x6 board's colours show which corner is the first, however the camera is held."""
    image = render_pair(unlike_rig(), poses(1, seed=4)[0])[0]
    upright, turned = find_corners(image, BOARD), find_corners(image[::-1, ::-1].copy(), BOARD)
    height, width = image.shape
    np.testing.assert_allclose(np.array([width - 1, height - 1]) - turned, upright, atol=0.3)


@pytest.mark.parametrize("board", [Board(8, 6, 0.025), Board(7, 5, 0.025), Board(6, 6, 0.025)])
def test_boards_that_look_the_same_turned_get_one_order_in_both_views(board: Board) -> None:
    """If the detector turned the right view, that is undone to match the left view."""
    grid = np.dstack(np.meshgrid(np.arange(board.columns) * 20.0, np.arange(board.rows) * 20.0))
    left, right = grid.reshape(-1, 2) + 50, grid.reshape(-1, 2) * 0.9 + np.array([20, 60])
    turns = [grid * 0.9 + np.array([20, 60])]
    turns.append(turns[0][::-1, ::-1])
    if board.columns == board.rows:
        turns += [np.rot90(turns[0]), np.rot90(turns[0], 3)]
    for turn in turns:
        np.testing.assert_array_equal(agree(left, turn.reshape(-1, 2), board), right)


def test_an_image_without_a_board_gives_no_corners() -> None:
    """Noise and an empty wall show no board."""
    noise = np.random.default_rng(1).integers(0, 255, (240, 320)).astype(np.uint8)
    assert find_corners(noise, BOARD).shape == (0, 2)
    assert find_corners(np.full((240, 320, 3), 200, np.uint8), BOARD).shape == (0, 2)


def test_corners_from_a_detector_that_looks_from_behind_are_turned_over() -> None:
    """Mirrored rows are corrected, and corners that begin at the black end are rotated by 180 degrees."""
    image = render_pair(unlike_rig(), poses(1, seed=4)[0])[0]
    corners = find_corners(image, BOARD)
    grid = corners.reshape(BOARD.rows, BOARD.columns, 2)
    for changed in (grid[:, ::-1], grid[::-1], grid[::-1, ::-1]):
        np.testing.assert_array_equal(order_by_colour(changed.reshape(-1, 2), image, BOARD), corners)


def test_a_board_whose_colours_tell_keeps_its_corners_as_they_are() -> None:
    """The colours of a 9x6 board give its first corner: an upside-down right view is not turned to look like the left one."""
    left = np.dstack(np.meshgrid(np.arange(9) * 20.0, np.arange(6) * 20.0)).reshape(-1, 2)
    np.testing.assert_array_equal(agree(left, left[::-1], BOARD), left[::-1])
