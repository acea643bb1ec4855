"""The board as a flat texture: squares, white margin, and the hands that hold it. Pure.

Values are multiplied by their opacity beforehand, so that layers can be blurred, averaged and laid over a room.
"""

from dataclasses import dataclass
from typing import Final, assert_never

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.marked import AprilGrid, Charuco, MarkFamily

AROUND: Final = 3
"""Squares around the outer corners: the margin, the cardboard and the hands."""

_FINEST: Final = 64
"""Texels per square: more than any camera here sees."""

_LEVELS: Final = 5
GREY_OF_PAPER: Final = 235.0
_BLACK, _CARD, _SKIN = 22.0, 150.0, 130.0
_LIGHT_FALL: Final = 0.2
"""By how much the lamp's light falls off from one corner of the print to the other."""

Layer = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Level:
    """One size of the texture.

    Attributes:
        layer: (H, W, 2) uint8: grey times opacity, opacity.
        texels: per square.
        lead: squares of the print before its first corner.
    """

    layer: Layer
    texels: int
    lead: float

    def from_squares(self) -> NDArray[np.float64]:
        """Return the (3, 3) matrix that takes board coordinates, in squares from the first inner corner, to texels."""
        shift = (
            round(self.lead * _FINEST) / _FINEST * self.texels + AROUND * self.texels - 0.5
        )  # texel 0 has its middle half a texel from the edge
        return np.array([[self.texels, 0, shift], [0, self.texels, shift], [0, 0, 1.0]])


def outline(board: Board) -> NDArray[np.float64]:
    """Return the corners of the whole texture, in squares: (4, 2)."""
    around = lead_of(board) + AROUND
    low = -around
    right, bottom = (board.points_m()[-1, :2] / board.square_m + around).tolist()
    return np.array([[low, low], [right, low], [right, bottom], [low, bottom]], np.float64)


def lead_of(board: Board) -> float:
    """Return how much of the print lies before the first corner, in squares: one square, or the gap of an AprilGrid."""
    return board.marks.gap_share if isinstance(board.marks, AprilGrid) else 1.0


def _pattern(board: Board, n: int) -> NDArray[np.float64]:
    """Return the print without its margin, `n` texels per square; black is 0, white 255."""
    rows, columns = board.rows + 1, board.columns + 1
    match board.marks:
        case None:
            checks = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
            return np.asarray(checks.repeat(n, 0).repeat(n, 1) * 255.0)
        case Charuco(family, share):
            dictionary = cv2.aruco.getPredefinedDictionary(family.value)
            sheet = cv2.aruco.CharucoBoard((columns, rows), 1.0, share, dictionary)
            return np.asarray(sheet.generateImage((columns * n, rows * n), marginSize=0), np.float64)
        case AprilGrid():
            return _tags(board, n)
        case _:
            assert_never(board.marks)


def _tags(board: Board, n: int) -> NDArray[np.float64]:
    """Paint an AprilGrid as Kalibr prints it: tags, and black squares in the gaps' crossings."""
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.APRILTAG_36H11.value)
    gap, wide, high = round(lead_of(board) * n), board.columns // 2, board.rows // 2
    sheet = np.full((high * (n + gap) + gap, wide * (n + gap) + gap), 255.0)
    for row in range(high + 1):
        for column in range(wide + 1):
            y, x = (each * (n + gap) for each in (row, column))
            sheet[y : y + gap, x : x + gap] = 0
            if row < high and column < wide:
                tag = np.asarray(cv2.aruco.generateImageMarker(dictionary, row * wide + column, 8, borderBits=1))
                large = cv2.resize(tag, (n, n), interpolation=cv2.INTER_NEAREST)
                sheet[y + gap : y + gap + n, x + gap : x + gap + n] = large
    return sheet


def printed(board: Board, grip: int) -> tuple[Level, ...]:
    """Paint the board in two hands.

    Args:
        board: the board.
        grip: 0: thumbs on the margin; 1, 2: a hand over the squares on the left or on the right.

    Returns:
        The texture from its finest size on, each half as large as the one before.
    """
    n = _FINEST
    squares = np.where(_pattern(board, n) > 127, GREY_OF_PAPER, _BLACK)
    paper = np.pad(squares, n, constant_values=GREY_OF_PAPER)
    card = np.pad(paper, n // 2, constant_values=_CARD)
    rest = (2 * AROUND - 3) * n // 2
    grey = np.pad(card, rest, constant_values=0)
    opacity = np.pad(np.full(card.shape, 255.0), rest, constant_values=0)
    height, width = grey.shape
    light = 1 - _LIGHT_FALL * np.add.outer(np.linspace(0, 0.5, height), np.linspace(0, 0.5, width))
    reach = [1.5 if grip == 1 else 0.0, 1.5 if grip == 2 else 0.0]  # the grips are named above
    for sign, over in zip((1, -1), reach, strict=True):
        _hold(grey, opacity, sign, over, n)
    layer = np.dstack([np.rint(grey * light), opacity]).astype(np.uint8)
    levels = [Level(layer, n, lead_of(board))]
    for _ in range(_LEVELS - 1):
        last = levels[-1]
        size = (last.layer.shape[1] // 2, last.layer.shape[0] // 2)
        levels.append(
            Level(np.asarray(cv2.resize(last.layer, size, interpolation=cv2.INTER_AREA)), last.texels // 2, last.lead)
        )
    return tuple(levels)


def _hold(grey: NDArray[np.float64], opacity: NDArray[np.float64], sign: int, over: float, n: int) -> None:
    """Paint one hand: fist beside the card, thumb on it, reaching `over` squares into the pattern."""
    height, width = grey.shape
    edge = (AROUND - 1.5) * n
    middle = height * 0.6

    def at(x: float) -> int:
        return round(x if sign > 0 else width - 1 - x)

    fist, thumb = (at(edge * 0.45), round(middle)), (at(edge + 0.35 * n), round(middle - 0.5 * n))
    for place, value in ((grey, _SKIN), (opacity, 255.0)):
        cv2.ellipse(place, fist, (round(0.7 * n), round(1.5 * n)), 8 * sign, 0, 360, value, -1)
        cv2.ellipse(place, thumb, (round(0.8 * n), round(0.3 * n)), 15 * sign, 0, 360, value, -1)
        if over:
            reach = round((1.0 + over / 2) * n)
            for finger in range(4):
                where = (at(edge + reach - 0.3 * n), round(middle + (finger - 1.5) * 0.62 * n))
                shade = value if place is opacity else value - 9 * finger
                cv2.ellipse(place, where, (reach, round(0.32 * n)), 5 * sign, 0, 360, shade, -1)
