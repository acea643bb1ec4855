"""Real sessions of $SCAN_DATA, as they are and with a mistake made on their corners: what is named."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from common.orientation import Flip, Orientation
from phone_host.calibration.arrangement import turned_corners
from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.board_views import look_for_boards
from phone_host.calibration.calibrate import Sizes, calibrate
from phone_host.calibration.causes.mistakes import Finding
from phone_host.calibration.causes.name import BoardSession, name_mistake
from phone_host.calibration.target import Board, agree
from phone_host.stereo.view_files import pair_files


@dataclass(frozen=True, slots=True)
class Real:
    """A real rig's views: two globs below $SCAN_DATA, and the board."""

    left: str
    right: str
    board: Board


REAL: Final = {
    "opencv_stereo_calib": Real("opencv_stereo_calib/left*", "opencv_stereo_calib/right*", Board(9, 6, 0.025)),
    "simplestereo_rig1": Real(
        "simplestereo_rig1/calib/*_L.png", "simplestereo_rig1/calib/*_R.png", Board(7, 6, 0.0605)
    ),
    "sourishg_rig": Real("sourishg_rig/calib_imgs/1/left*", "sourishg_rig/calib_imgs/1/right*", Board(9, 6, 0.025)),
    "stereopi_rig": Real("stereopi_rig/pairs/left*", "stereopi_rig/pairs/right*", Board(9, 6, 0.025)),
}


@cache
def real_pairs(name: str) -> tuple[tuple[BoardPair, ...], Board, Sizes]:
    """Return a real session's corners, its board and the images' sizes."""
    data, real = Path(os.environ["SCAN_DATA"]), REAL[name]
    views = look_for_boards(pair_files(str(data / real.left), str(data / real.right)), real.board, lambda: None)
    return views.pairs, real.board, views.sizes_px


def judged(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> Finding | None:
    """Return what is named for a session."""
    try:
        found = calibrate(pairs, board, sizes_px)
    except DataError as failure:
        return name_mistake(BoardSession(pairs=tuple(pairs), board=board, sizes_px=sizes_px), failure)
    return name_mistake(BoardSession(pairs=tuple(pairs), board=board, sizes_px=sizes_px), found)


def variants(name: str) -> Iterator[tuple[str, list[BoardPair], Board, Sizes]]:
    """Give a real session as it is, and with mistakes: the right camera knocked, zoomed, mirrored, on its head; sides swapped; pictures exchanged."""
    pairs, board, sizes_px = real_pairs(name)
    yield "as it is", list(pairs), board, sizes_px
    width, height = sizes_px[1]
    middle, half = np.array([width / 2, height / 2]), len(pairs) // 2

    def changed(what: np.ndarray, first: int) -> list[BoardPair]:
        return [
            pair
            if index < first
            else BoardPair(pair.name, pair.left_px, np.asarray(cv2.perspectiveTransform(pair.right_px[None], what)[0]))
            for index, pair in enumerate(pairs)
        ]

    focal = 0.9 * width
    inner = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
    knock = inner @ np.asarray(cv2.Rodrigues(np.radians([0.15, 0.1, 0.0]))[0]) @ np.linalg.inv(inner)
    yield "knocked by 0.18 degrees", changed(knock, half), board, sizes_px
    zoom = np.array([[1.02, 0, -0.02 * middle[0]], [0, 1.02, -0.02 * middle[1]], [0, 0, 1]])
    yield "zoomed by 2 %", changed(zoom, half), board, sizes_px
    for word, turn in (("mirrored", Orientation(0, Flip.H)), ("on its head", Orientation(180))):
        placed = [(pair, turned_corners(pair.right_px, sizes_px[1], turn, board)) for pair in pairs]
        views = [BoardPair(pair.name, pair.left_px, agree(pair.left_px, right, board)) for pair, right in placed]
        yield word, views, board, sizes_px
    swapped = [BoardPair(pair.name, pair.right_px, agree(pair.right_px, pair.left_px, board)) for pair in pairs]
    yield "sides swapped", swapped, board, (sizes_px[1], sizes_px[0])
    order = [1, 0, *range(2, len(pairs))]
    exchanged = [
        BoardPair(pair.name, pair.left_px, agree(pair.left_px, pairs[index].right_px, board))
        for pair, index in zip(pairs, order, strict=True)
    ]
    yield "two exchanged", exchanged, board, sizes_px


def real_sessions() -> Iterator[tuple[str, str]]:
    """Give each real session's name and what is said of it; nothing without $SCAN_DATA."""
    if not os.environ.get("SCAN_DATA"):
        return
    for name in REAL:
        for what, pairs, board, sizes_px in variants(name):
            found = judged(pairs, board, sizes_px)
            yield f"{name}, {what}", "nothing" if found is None else f"{found.mistake.value}: {found.sentence}"
