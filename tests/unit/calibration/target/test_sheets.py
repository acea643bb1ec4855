"""Boards and mats are printed to scale: an independent reader renders the PDF, and OpenCV finds the board in it where it should be."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest

from common.errors import SettingsError
from phone_host.calibration.target.corners import Board, find_corners
from phone_host.calibration.target.marked import MarkFamily
from phone_host.calibration.target.sheet import Ink, Paper, Sheet, pdf, svg
from phone_host.calibration.target.sheet_layout import (
    Chessboard,
    MarkedBoard,
    chessboard_sheet,
    largest_square_mm,
    marked_sheet,
    screen_board,
)
from phone_host.cli import main
from phone_host.model import Image

_DPI = 200
_PX_A_MM = _DPI / 25.4
_PIXEL_MM = 1 / _PX_A_MM
"""The renderer lets rectangles begin at whole pixels."""


def _rendered(sheet: Sheet) -> Image:
    """The PDF's only page as an image of 200 dots per inch."""
    document = pypdfium2.PdfDocument(pdf(sheet))
    assert len(document) == 1
    page = document[0]
    points = np.array([page.get_width(), page.get_height()])
    np.testing.assert_allclose(points * 25.4 / 72, [sheet.width_mm, sheet.height_mm], atol=0.01)
    return np.asarray(page.render(scale=_DPI / 72, grayscale=True).to_numpy(), np.uint8)


@pytest.mark.parametrize(
    ("board", "paper"),
    [
        (Chessboard(10, 7, 25.0), Paper.A4),
        (Chessboard(6, 9, 28.0), Paper.A4),  # upright
        (Chessboard(10, 7, 36.0), Paper.A3),
        (Chessboard(9, 6, 24.5), Paper.LETTER),
    ],
)
def test_a_chessboard_is_found_in_its_print_with_squares_of_the_right_size(board: Chessboard, paper: Paper) -> None:
    """The corners of the rendered PDF are one square apart, as far as the renderer's whole pixels let it see, and lie in its middle."""
    sheet = chessboard_sheet(board, paper)
    corners = find_corners(_rendered(sheet), Board(board.columns - 1, board.rows - 1, 0.01))
    grid = corners.reshape(board.rows - 1, board.columns - 1, 2) / _PX_A_MM
    across = np.linalg.norm(grid[:, -1] - grid[:, 0], axis=1) / (board.columns - 2)
    down = np.linalg.norm(grid[-1] - grid[0], axis=1) / (board.rows - 2)
    assert [across.mean(), down.mean()] == pytest.approx([board.square_mm] * 2, abs=0.03)
    np.testing.assert_allclose(
        (corners.mean(axis=0) + 0.5) / _PX_A_MM, [sheet.width_mm / 2, sheet.height_mm / 2], atol=_PIXEL_MM
    )


def test_the_mat_is_a_charuco_board_of_opencv() -> None:
    """OpenCV's own detector finds all 63 corners of the printed mat, numbered as in its CharucoBoard, 25 mm apart."""
    mat = MarkedBoard(Chessboard(10, 8, 25.0), 18.0, MarkFamily.ARUCO_5X5)
    sheet = marked_sheet(mat, Paper.A4, "mat", "phone-host scan")
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.ARUCO_5X5.value)
    board = cv2.aruco.CharucoBoard((10, 8), 25.0, 18.0, dictionary)
    corners, ids, _, marks = cv2.aruco.CharucoDetector(board).detectBoard(_rendered(sheet))
    assert sorted(marks.ravel().tolist()) == list(range(40))
    assert ids.ravel().tolist() == list(range(63))
    x, y = np.asarray(board.getChessboardCorners())[:, :2].T
    middle = np.array([(sheet.width_mm - 250) / 2, (sheet.height_mm - 200) / 2])
    expected = np.column_stack([x, y]) + middle
    np.testing.assert_allclose((np.asarray(corners).reshape(-1, 2) + 0.5) / _PX_A_MM, expected, atol=_PIXEL_MM)


def test_a_ruler_of_100_mm_lies_beside_the_board() -> None:
    """The rulers' longest rectangles are 100 mm, and the rendered one is as long; nothing is painted where printers leave the paper blank."""
    sheet = chessboard_sheet(Chessboard(10, 7, 25.0), Paper.A4)
    lines = [each for each in sheet.rectangles if max(each.width_mm, each.height_mm) == 100]
    assert len(lines) == 2
    [along] = [each for each in lines if each.width_mm == 100]
    row = int((along.y_mm + along.height_mm / 2) * _PX_A_MM)
    end = int((along.x_mm + 101) * _PX_A_MM)  # words follow
    dark = np.flatnonzero(_rendered(sheet)[row, :end] < 128)
    assert np.ptp(dark) / _PX_A_MM == pytest.approx(100, abs=0.2)
    left = min(each.x_mm for each in sheet.rectangles)
    bottom = max(each.y_mm + each.height_mm for each in sheet.rectangles)
    assert left > 4.8
    assert bottom < sheet.height_mm - 4.8


@pytest.mark.parametrize("paper", list(Paper))
@pytest.mark.parametrize("shape", [(10, 8), (8, 10)])
def test_a_mat_says_what_it_is_though_it_fills_the_paper(paper: Paper, shape: tuple[int, int]) -> None:
    """Name, ruler and "print at 100 %" stand where there is room, run to no edge that printers leave blank, and cover no square. What has no ruler is measured itself."""
    sheet = marked_sheet(
        MarkedBoard(Chessboard(*shape, 25.0), 18.0, MarkFamily.ARUCO_5X5), paper, "mat, named", "calibrate it"
    )
    left, upper = (sheet.width_mm - shape[0] * 25) / 2, (sheet.height_mm - shape[1] * 25) / 2
    rulers = [each for each in sheet.rectangles if max(each.width_mm, each.height_mm) == 100]
    assert len(rulers) == (2 if paper is Paper.A3 else 1)
    side = "wide" if shape[0] > shape[1] else "high"
    assert sheet.check == (
        "both rulers: 100 mm" if paper is Paper.A3 else f"the ruler, 100 mm, and the board, 250 mm {side}"
    )
    page = pypdfium2.PdfDocument(pdf(sheet))[0]
    text = page.get_textpage()
    said = "".join(text.get_text_bounded().split())
    for words in (f"measure {sheet.check}", "mat, named", "print at 100 %, not fitted to the page; then: calibrate it"):
        assert "".join(words.split()) in said
    for index in range(text.count_chars()):
        x0, y0, x1, y1 = (each * 25.4 / 72 for each in text.get_charbox(index))
        assert 4.6 < x0 <= x1 < sheet.width_mm - 4.6
        assert 4.6 < y0 <= y1 < sheet.height_mm - 4.6
        assert x1 < left or x0 > sheet.width_mm - left or y1 < upper or y0 > sheet.height_mm - upper


def test_a_board_without_room_beside_it_is_measured_itself() -> None:
    """10x7 squares of 28 mm on A4 leave 8.5 and 7 mm."""
    sheet = chessboard_sheet(Chessboard(10, 7, 28.0), Paper.A4)
    assert (sheet.check, sheet.words) == ("the board: 280 x 196 mm", ())


def test_the_pdf_says_in_words_what_it_is() -> None:
    """A reader gets the text: the ruler's length, the board, and the command; and is asked not to fit the page."""
    file = pdf(chessboard_sheet(Chessboard(10, 7, 25.0), Paper.A4))
    text = pypdfium2.PdfDocument(file)[0].get_textpage().get_text_bounded()
    assert "measure both rulers: 100 mm" in text
    assert "9x6 inner corners, squares of 25 mm" in text
    assert "phone-host calibrate left right --square 25mm" in text
    assert b"/PrintScaling /None" in file


def test_svg_and_pdf_paint_the_same() -> None:
    """The SVG's user unit is a millimetre, and its rectangles are those of the sheet."""
    sheet = marked_sheet(
        MarkedBoard(Chessboard(4, 3, 20.0), 14.0, MarkFamily.ARUCO_4X4), Paper.LETTER, "a <mat>", "& on"
    )
    root = ET.fromstring(svg(sheet))
    assert root.get("width") == f"{sheet.width_mm:g}mm"
    assert root.get("viewBox") == f"0 0 {sheet.width_mm:g} {sheet.height_mm:g}"
    painted = root.findall("{http://www.w3.org/2000/svg}rect")[1:]
    assert len(painted) == len(sheet.rectangles)
    image = np.full((round(sheet.height_mm * 4), round(sheet.width_mm * 4)), 255, np.uint8)
    for each in painted:
        x, y, width, height = (float(each.get(name, "")) for name in ("x", "y", "width", "height"))
        part = tuple(slice(round(at * 4), round((at + size) * 4)) for at, size in ((y, height), (x, width)))
        image[part] = 0 if each.get("fill") == Ink.BLACK.value else 255
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.ARUCO_4X4.value)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    assert sorted(ids.ravel().tolist()) == list(range(6))


def test_what_does_not_fit_is_refused() -> None:
    """A board larger than the paper, and more squares than fit."""
    with pytest.raises(SettingsError, match="a board of 300 x 210 mm does not fit on A4"):
        chessboard_sheet(Chessboard(10, 7, 30.0), Paper.A4)
    with pytest.raises(SettingsError, match="do not fit on A4: give fewer squares"):
        largest_square_mm(Paper.A4, 500, 500, 0.5)
    assert largest_square_mm(Paper.A4, 10, 7, 0.5) == 25


def test_more_marks_than_a_family_has_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """100x60 squares want 3000 marks: one line says how many there are; nothing is written."""
    assert main(["target", "charuco", "--size", "100x60", "--square", "2mm", "--out", str(tmp_path)]) == 2
    assert "hold 3000 marks, and the family 5x5 has 1000: give fewer squares" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_screen_shows_whole_pixels() -> None:
    """On a screen of 1920x1080 pixels and 15.6 inches a square of a 9x6 board is 120 pixels of 0.1799 mm, and the board is found."""
    board = screen_board(10, 7, (1920, 1080), 15.6 * 25.4)
    assert board.square_px == 120
    assert board.pitch_mm == pytest.approx(15.6 * 25.4 / math.hypot(1920, 1080))
    assert board.square_mm == pytest.approx(21.5846, abs=0.001)
    assert len(find_corners(board.image, Board(9, 6, 0.02))) == 54
    assert math.isnan(screen_board(10, 7, (1920, 1080)).square_mm)
    with pytest.raises(SettingsError, match="do not fit on a screen of 60x60 px"):
        screen_board(10, 7, (60, 60))
