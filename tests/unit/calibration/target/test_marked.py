"""Boards with coded marks: corners are found to a tenth of a pixel, a part of the board is enough, and what is hidden is NaN."""

from contextlib import nullcontext

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError, SettingsError
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.target.board_names import named_board
from phone_host.calibration.target.board_size import size_seen
from phone_host.calibration.target.corners import Board, agree, find_corners
from phone_host.calibration.target.marked import MarkFamily
from phone_host.calibration.target.marks_seen import SeenMarks, find_marks, require_marks
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import SeenLook, look_at
from phone_host.calibration.target.sheet import Ink
from phone_host.calibration.target.sheet_layout import Chessboard, MarkedBoard, marked_rectangles
from phone_host.model import Image, Side
from tests.support.boards import exact_pairs, poses
from tests.support.rigs import unlike_rig

_CHARUCO = named_board("charuco:8x6:28mm:20mm:5x5", None)
_GRID = named_board("aprilgrid:5x4:30mm:9mm", None)
_PX_A_MM = 6


def _charuco_sheet() -> tuple[Image, NDArray[np.float64]]:
    """The board as it is printed, 6 px to a mm, and its corners' places in that image, px."""
    board = MarkedBoard(Chessboard(8, 6, 28.0), 20.0, MarkFamily.ARUCO_5X5)
    image = np.full(((6 * 28 + 40) * _PX_A_MM, (8 * 28 + 40) * _PX_A_MM), 255, np.uint8)
    for each in marked_rectangles(board):
        x, y = ((at + 20) * _PX_A_MM for at in (each.x_mm, each.y_mm))
        part = (
            slice(round(y), round(y + each.height_mm * _PX_A_MM)),
            slice(round(x), round(x + each.width_mm * _PX_A_MM)),
        )
        image[part] = 0 if each.ink is Ink.BLACK else 255
    return image, (_CHARUCO.points_m()[:, :2] * 1000 + 28 + 20) * _PX_A_MM - 0.5


def _grid_sheet(border: int, *, upward: bool) -> tuple[Image, NDArray[np.float64]]:
    """An AprilGrid as Kalibr prints it: tags, and black squares in the gaps' crossings."""
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.APRILTAG_36H11.value)
    side, gap = 30 * _PX_A_MM, 9 * _PX_A_MM
    image = np.full((4 * (side + gap) + 3 * gap, 5 * (side + gap) + 3 * gap), 255, np.uint8)
    cells = 6 + 2 * border
    for row in range(5):
        for column in range(6):
            y, x = (gap + each * (side + gap) for each in (row, column))
            image[y : y + gap, x : x + gap] = 0
            if row < 4 and column < 5:
                number = (3 - row if upward else row) * 5 + column
                tag = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, cells, borderBits=border), np.uint8)
                part = (slice(y + gap, y + gap + side), slice(x + gap, x + gap + side))
                image[part] = cv2.resize(tag, (side, side), interpolation=cv2.INTER_NEAREST)
    return image, _GRID.points_m()[:, :2] * 1000 * _PX_A_MM + 2 * gap - 0.5


def _seen(
    sheet: Image, places: NDArray[np.float64], size: tuple[int, int] = (960, 720)
) -> tuple[Image, NDArray[np.float64]]:
    """The sheet as a camera sees it from aside, softened and with noise; and where its corners then are."""
    height, width = sheet.shape
    share = np.array([[0.16, 0.12], [0.9, 0.2], [0.84, 0.9], [0.1, 0.8]])
    corners = (share * size).astype(np.float32)
    at = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32) - 0.5
    view = cv2.getPerspectiveTransform(at, corners)
    fine = 3
    grow = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    large = cv2.warpPerspective(sheet, grow @ view, (size[0] * fine, size[1] * fine), borderValue=(128,))
    image = cv2.GaussianBlur(cv2.resize(large, size, interpolation=cv2.INTER_AREA), (0, 0), 0.7)
    noise = np.random.default_rng(5).normal(0, 3, image.shape)
    moved = cv2.perspectiveTransform(places[np.newaxis], view)[0]
    return np.asarray(np.clip(image + noise, 0, 255), np.uint8), np.asarray(moved, np.float64)


@pytest.mark.parametrize(
    ("board", "sheet"),
    [(_CHARUCO, _charuco_sheet()), (_GRID, _grid_sheet(1, upward=False)), (_GRID, _grid_sheet(2, upward=True))],
)
def test_all_corners_are_found_where_they_are(board: Board, sheet: tuple[Image, NDArray[np.float64]]) -> None:
    """ChArUco; AprilGrids of either numbering and border: of 19 corners 18 are found at least, each within 0.25 px, their mean shift within 0.05 px."""
    image, true = _seen(*sheet)
    found = find_corners(image, board)
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(found).all(axis=1))
    assert seen.mean() > 18 / 19
    off = found[seen] - true[seen]
    assert np.linalg.norm(off, axis=1).max() < 0.25
    assert np.abs(off.mean(axis=0)).max() < 0.05


@pytest.mark.parametrize(("board", "sheet"), [(_CHARUCO, _charuco_sheet()), (_GRID, _grid_sheet(2, upward=True))])
def test_a_part_of_the_board_is_enough(board: Board, sheet: tuple[Image, NDArray[np.float64]]) -> None:
    """A hand covers a part, the image's edge cuts another: the rest is found in its own places, the hidden corners are NaN."""
    image, true = _seen(*sheet)
    image[250:480, 300:520] = 130
    cut = np.ascontiguousarray(image[:, 260:])
    found = find_corners(cut, board)
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(found).all(axis=1))
    assert 8 <= seen.sum() < len(found) - 8
    np.testing.assert_allclose(found[seen] + [260, 0], true[seen], atol=1.0)
    hidden = (true[:, 0] > 302) & (true[:, 0] < 518) & (true[:, 1] > 252) & (true[:, 1] < 478)
    assert hidden.any()
    assert not seen[hidden].any()
    np.testing.assert_array_equal(agree(found, found[::-1], board), found[::-1])  # marks leave nothing to agree on


@pytest.mark.parametrize("border", [1, 2])
def test_tags_are_read_from_far_away(border: int) -> None:
    """Tags of 45 px, blurred until they hang together with the squares they touch: nine in ten corners are found within 0.5 px."""
    image, places = _seen(*_grid_sheet(border, upward=False), size=(400, 300))
    found = find_corners(image, _GRID)
    assert np.isfinite(found[:, 0]).mean() >= 0.9
    assert np.nanmax(np.linalg.norm(found - places, axis=1)) < 0.5


def test_a_photograph_is_read_small_and_refined_whole() -> None:
    """12 megapixels: as exact in px as a small image."""
    image, true = _seen(*_charuco_sheet(), size=(4000, 3000))
    off: NDArray[np.float64] = find_corners(image, _CHARUCO) - true
    assert float(np.nanmax(np.linalg.norm(off, axis=1))) < 0.5


def test_nothing_is_found_where_nothing_is() -> None:
    """Grey, noise, and a chessboard without marks."""
    noise = np.random.default_rng(3).integers(0, 255, (480, 640)).astype(np.uint8)
    for image in (np.full((480, 640), 99, np.uint8), noise):
        for board in (_CHARUCO, _GRID):
            assert find_corners(image, board).shape == (0, 2)
        assert size_seen(image) is None


def test_a_mirror_is_told_by_the_marks() -> None:
    """Marks are not read in a mirror: the side is named, whatever else could not be done."""
    image, _ = _seen(*_charuco_sheet())
    mirrored = np.ascontiguousarray(image[:, ::-1])
    corners = find_corners(mirrored, _CHARUCO)
    assert len(corners) == 0
    look = look_at(mirrored, corners, _CHARUCO)
    assert look.is_mirrored
    plain = look_at(image, find_corners(image, _CHARUCO), _CHARUCO)
    looks = (SeenLook("a", Side.LEFT, plain), SeenLook("b", Side.RIGHT, look))
    series = BoardSeries(pairs=(), board=_CHARUCO, sizes_px=((960, 720), (960, 720)), looks=looks)
    found = name_mistake(series, DataError("nothing", "nothing"))
    assert found is not None
    assert found.code is Mistake.MIRRORED
    assert found.evidence.misplaced is not None
    assert found.evidence.misplaced.side is Side.RIGHT


@pytest.mark.parametrize(
    ("text", "square_mm", "corners", "square_m"),
    [
        ("9x6", 25.0, (9, 6), 0.025),
        ("charuco:10x8:25mm:18mm:5x5", None, (9, 7), 0.025),
        ("ChArUco:10x8:25mm:18mm:5x5", 24.8, (9, 7), 0.0248),
        ("aprilgrid:6x6:88mm:26.4mm", None, (12, 12), 0.088),
    ],
)
def test_boards_are_named(text: str, square_mm: float | None, corners: tuple[int, int], square_m: float) -> None:
    """As the help says; a measured square counts more than the name."""
    board = named_board(text, square_mm)
    assert (board.columns, board.rows) == corners
    assert board.square_m == pytest.approx(square_m)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("9x6", "--square is missing"),
        ("charuco:10x8", "is no ChArUco board: give squares"),
        ("charuco:10x8:25mm:25mm:5x5", "is no ChArUco board"),
        ("aprilgrid:1x6:30mm:9mm", "is no AprilGrid: give tags"),
        ("charuco:8x6:0mm:0mm:5x5", "is no ChArUco board"),
        ("aprilgrid:6x6:0mm:0mm", "is no AprilGrid"),
        ("charuco:100x100:25mm:18mm:5x5", "100x100 squares hold 5000 marks, and the family 5x5 has 1000: give fewer"),
        ("aprilgrid:30x30:30mm:9mm", "30x30 tags are 900, the family has 587: give fewer"),
    ],
)
def test_what_names_no_board_is_refused(text: str, said: str) -> None:
    """One line with what would be right."""
    with pytest.raises(SettingsError, match=said):
        named_board(text, None)


def test_a_square_that_contradicts_the_boards_name_is_refused() -> None:
    """A print is some per cent off; half as large again is another board, or a slip."""
    with pytest.raises(SettingsError, match="--square is 40 mm, and --board says 25 mm: measure it again"):
        named_board("charuco:10x8:25mm:18mm:5x5", 40.0)
    with pytest.raises(SettingsError, match=r"--square is 2\.5 mm, and --board says 30 mm"):
        named_board("aprilgrid:5x4:30mm:9mm", 2.5)


def test_an_aprilgrid_has_gaps() -> None:
    """Its corners lie a tag and a gap apart in turn."""
    x = np.unique(_GRID.points_m()[:, 0])
    np.testing.assert_allclose(np.diff(x), [0.03, 0.009] * 4 + [0.03], atol=1e-9)


def test_a_rig_is_calibrated_from_parts_of_boards() -> None:
    """Each view lacks three corners in ten, others on the left than on the right: the true baseline comes within 1 %, and nobody is accused."""
    board = Board(9, 6, 0.025, _CHARUCO.marks)
    random = np.random.default_rng(0)
    pairs = []
    for pair in exact_pairs(unlike_rig(), poses(12, seed=3), noise_px=0.1):
        sides = [np.where(random.random((54, 1)) < 0.3, np.nan, seen) for seen in (pair.left_px, pair.right_px)]
        pairs.append(BoardPair(pair.name, sides[0], sides[1]))
    sizes = ((640, 480), (1280, 720))
    found = calibrate(pairs, board, sizes)
    assert len(found.used) == 12
    truth = np.linalg.norm(unlike_rig().t_right_left_m)
    assert np.linalg.norm(found.rig.t_right_left_m) == pytest.approx(truth, rel=0.01)
    assert name_mistake(BoardSeries(pairs=tuple(pairs), board=board, sizes_px=sizes), found) is None


@pytest.mark.parametrize(
    ("board", "sheet"),
    [(_CHARUCO, _charuco_sheet()), (_GRID, _grid_sheet(1, upward=False)), (_GRID, _grid_sheet(2, upward=True))],
)
def test_marks_are_no_glare(board: Board, sheet: tuple[Image, NDArray[np.float64]]) -> None:
    """A mark inside a white square leaves the square's edges their contrast: a clear image of a marked board is neither washed out nor blurred."""
    image, _ = _seen(*sheet)
    look = look_at(image, find_corners(image, board), board)
    assert look.washed < 0.03
    assert 1 < look.edge_px < 3.5


@pytest.mark.parametrize(
    ("sheet", "given", "said"),
    [
        (_charuco_sheet(), "charuco:8x6:28mm:20mm:5x5", ""),
        (_charuco_sheet(), "charuco:8x9:28mm:20mm:5x5", ""),  # the last rows may be hidden
        (
            _charuco_sheet(),
            "charuco:8x5:28mm:20mm:5x5",
            "ArUco 5x5 and 8x6 squares, .*: give --board charuco:8x6:28mm:20mm:5x5",
        ),
        (_charuco_sheet(), "charuco:10x6:28mm:20mm:5x5", "and 8x6 squares, --board says charuco:10x6:28mm:20mm:5x5"),
        (_charuco_sheet(), "charuco:6x8:28mm:20mm:5x5", "and 8x6 squares"),
        (
            _charuco_sheet(),
            "charuco:8x6:28mm:20mm:4x4",
            "ArUco 5x5 and 8x6 squares, .*: give --board charuco:8x6:28mm:20mm:5x5",
        ),
        (_charuco_sheet(), "aprilgrid:6x6:30mm:9mm", "5x5 and 8x6 squares, .*: give --board charuco:8x6:25mm:18mm:5x5"),
        (_grid_sheet(2, upward=True), "aprilgrid:5x4:30mm:9mm", ""),
        (
            _grid_sheet(1, upward=False),
            "aprilgrid:4x5:30mm:9mm",
            "AprilTag 36h11 and 5x4 tags, .*: give --board aprilgrid:5x4",
        ),
        (_grid_sheet(2, upward=True), "charuco:8x6:28mm:20mm:4x4", "marks of the family AprilTag 36h11 and 5x4 tags"),
    ],
)
def test_other_marks_than_the_named_board_has_are_told(
    sheet: tuple[Image, NDArray[np.float64]], given: str, said: str
) -> None:
    """Family and size are read from the marks; a board that fits, or of which the last rows are not seen, passes."""
    seen = find_marks([None, _seen(*sheet)[0]])
    with pytest.raises(SettingsError, match=said) if said else nullcontext():
        require_marks(seen, named_board(given, None))


def test_few_marks_tell_the_family_alone() -> None:
    """Four marks of the upper left corner do not tell where rows end; without marks, or for a chessboard, nothing is said."""
    image = _seen(*_charuco_sheet())[0]
    part = np.full_like(image, 128)
    part[:360, :450] = image[:360, :450]
    seen = find_marks([part])
    assert seen is not None
    assert 3 <= len(seen.middles_px[0]) < 6
    require_marks(seen, named_board("charuco:12x6:28mm:20mm:5x5", None))
    with pytest.raises(
        SettingsError, match=r"family ArUco 5x5, --board says .*: give --board charuco:COLUMNSxROWS:28mm"
    ):
        require_marks(seen, named_board("charuco:8x6:28mm:20mm:6x6", None))
    require_marks(None, _CHARUCO)
    require_marks(seen, Board(9, 6, 0.025))
    assert find_marks([None, np.full((48, 64), 99, np.uint8)]) is None


def test_marks_in_no_order_tell_no_size() -> None:
    """Marks in one row, or strewn at random, fit no board: nothing is said of their size."""
    random = np.random.default_rng(3)
    strewn = {number: random.uniform(0, 640, 2) for number in range(20)}
    row = {number: np.array([50.0 * number, 10.0]) for number in range(8)}
    for middles in (strewn, row):
        require_marks(SeenMarks(MarkFamily.ARUCO_5X5, (middles,)), named_board("charuco:10x8:25mm:18mm:5x5", None))
