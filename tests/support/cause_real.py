"""Real series of $SCAN_DATA, as they are and with a mistake made on their corners: what is named."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.orientation import Flip, Orientation
from phone_host.calibration.failure_modes.arrangement import turned_corners
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.solve.calibrate import Sizes, calibrate
from phone_host.calibration.target.board_views import look_for_boards
from phone_host.calibration.target.corners import Board, agree, find_corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import Image
from phone_host.stereo.view_files import pair_files
from tests.support.cause_judge import finding_of
from tests.support.cause_series import Made
from tests.support.cause_spoils import blurring, lit

Points = NDArray[np.float64]


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
    """Return a real series's corners, its board and the images' sizes."""
    data, real = Path(os.environ["SCAN_DATA"]), REAL[name]
    views = look_for_boards(pair_files(str(data / real.left), str(data / real.right)), real.board, lambda: None)
    return views.pairs, real.board, views.sizes_px


def _pictures(name: str, count: int = 6) -> list[tuple[Image, Image]]:
    """Return the grey images of some pairs, at most 1280 px wide."""
    real, data = REAL[name], Path(os.environ["SCAN_DATA"])
    found = []
    for _, *paths in pair_files(str(data / real.left), str(data / real.right)).pairs[:count]:
        left, right = (np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8) for path in paths)
        found.append((left, right))
    return found


def _with_right(made: Made, what: Callable[[int, Points], Points], first: int = 0) -> Made:
    """Change the right corners of the views from one on."""
    pairs = [
        pair if index < first else BoardPair(pair.name, pair.left_px, what(index, pair.right_px))
        for index, pair in enumerate(made.pairs)
    ]
    return replace(made, pairs=pairs)


def _hung(made: Made, turn: Orientation) -> Made:
    """The right camera hangs otherwise."""
    width, height = turn.turned_size(made.sizes_px[1])
    pairs = [
        BoardPair(
            pair.name,
            pair.left_px,
            agree(pair.left_px, turned_corners(pair.right_px, made.sizes_px[1], turn, made.board), made.board),
        )
        for pair in made.pairs
    ]
    return replace(made, pairs=pairs, sizes_px=(made.sizes_px[0], (width, height)))


def _placed(made: Made) -> Iterator[tuple[str, Mistake, Made]]:
    """Mistakes of how cameras hang and of which pictures belong together."""
    yield "mirrored", Mistake.MIRRORED, _hung(made, Orientation(0, Flip.H))
    yield "on its head", Mistake.UPSIDE_DOWN, _hung(made, Orientation(180))
    yield "on its side", Mistake.TURNED, _hung(made, Orientation(90))
    swapped = [
        BoardPair(pair.name, pair.right_px, agree(pair.right_px, pair.left_px, made.board)) for pair in made.pairs
    ]
    yield "sides swapped", Mistake.SWAPPED, replace(made, pairs=swapped, sizes_px=(made.sizes_px[1], made.sizes_px[0]))
    order = [1, 0, *range(2, len(made.pairs))]
    exchanged = [
        BoardPair(pair.name, pair.left_px, agree(pair.left_px, made.pairs[index].right_px, made.board))
        for pair, index in zip(made.pairs, order, strict=True)
    ]
    yield "two exchanged", Mistake.PARTNERS, replace(made, pairs=exchanged)


def _moved(made: Made) -> Iterator[tuple[str, Mistake, Made]]:
    """Mistakes of what changed or moved while the views were taken."""
    width, height = made.sizes_px[1]
    middle, random = np.array([width / 2, height / 2]), np.random.default_rng(0)
    inner = np.array([[0.9 * width, 0, middle[0]], [0, 0.9 * width, middle[1]], [0, 0, 1]])

    def turned(degrees: Points) -> Points:
        return np.asarray(inner @ cv2.Rodrigues(np.radians(degrees))[0] @ np.linalg.inv(inner), np.float64)

    def mapped(corners: Points, what: Points) -> Points:
        return np.asarray(cv2.perspectiveTransform(corners[None], what)[0], np.float64)

    half = len(made.pairs) // 2
    knock, zoom = turned(np.array([0.15, 0.1, 0.0])), np.diag([1.02, 1.02, 1.0])
    zoom[:2, 2] = -0.02 * middle
    yield "knocked by 0.18 degrees", Mistake.UNSTIFF, _with_right(made, lambda _, seen: mapped(seen, knock), half)
    yield "zoomed by 2 %", Mistake.FOCUS, _with_right(made, lambda _, seen: mapped(seen, zoom), half)
    # A board that moves by about 6 px between or during the exposures, each view in its own direction, as hands do.
    ways = random.normal(0, 0.006 * width, (len(made.pairs), 2))
    # It turns and comes nearer as well: a shift alone is what a turned camera shows.
    turns, scales = random.normal(0, np.radians(0.8), len(ways)), 1 + random.normal(0, 0.012, len(ways))

    def jolted(index: int, seen: Points) -> Points:
        cos, sin = np.cos(turns[index]) * scales[index], np.sin(turns[index]) * scales[index]
        middle_px = seen.mean(axis=0)
        return np.asarray(
            (seen - middle_px) @ np.array([[cos, sin], [-sin, cos]]) + middle_px + ways[index], np.float64
        )

    yield "moved between the exposures", Mistake.SKEW, _with_right(made, jolted)

    def rolled(seen: Points, way: Points, lines: int) -> Points:
        return np.asarray(seen + way * (seen[:, 1:] / lines - 0.5) * 3, np.float64)

    pairs = [
        BoardPair(
            pair.name, rolled(pair.left_px, way * made.sizes_px[0][0] / width, made.sizes_px[0][1]),
            rolled(pair.right_px, way, height),
        )
        for pair, way in zip(made.pairs, ways, strict=True)
    ]  # fmt: skip
    yield "moved while rows were exposed", Mistake.ROWS, replace(made, pairs=pairs)


def variants(name: str) -> Iterator[tuple[str, Mistake | None, Made]]:
    """Give a real series as it is, and with a mistake of each class: made on its corners, blur and glare on its images.

    Args:
        name: of `REAL`.
    """
    pairs, board, sizes_px = real_pairs(name)
    rig = calibrate(list(pairs), board, sizes_px).rig
    made = Made(pairs=list(pairs), board=board, sizes_px=sizes_px, rig=rig)
    yield "as it is", None, made
    yield from _placed(made)
    yield from _moved(made)
    larger, measured_m = replace(board, square_m=board.square_m * 1.15), float(np.linalg.norm(rig.t_right_left_m))
    yield "square 15 % too large", Mistake.SQUARE, replace(made, board=larger, baseline_m=measured_m)
    random = np.random.default_rng(0)
    smears = {"out of focus": blurring(random, moving=False), "smeared": blurring(random, moving=True)}
    images = _pictures(name)
    for what, spoil in smears.items():
        spoiled = tuple((spoil(left), spoil(right)) for left, right in images)
        yield what, Mistake.BLUR, replace(made, pairs=[], images=spoiled)
    shining = tuple((_lit(left, board), _lit(right, board)) for left, right in images)
    yield "glare", Mistake.GLARE, replace(made, pairs=[], images=shining)


def _lit(image: Image, board: Board) -> Image:
    """A lamp's reflection on the board."""
    corners = find_corners(image, board)
    if not len(corners):
        return image
    x, y = corners[len(corners) // 3]
    return lit(image, (float(x), float(y)), 0.2 * float(np.ptp(corners, axis=0).max()))


@dataclass(frozen=True, slots=True)
class RealNamed:
    """What was named of a real series: the series, what was done to it, the mistake that is (None: none was made), the one named, and its sentence."""

    series: str
    what: str
    made: Mistake | None
    named: Mistake | None
    sentence: str


def named_real_series() -> Iterator[RealNamed]:
    """Judge each real series as it is and with each mistake; nothing without $SCAN_DATA."""
    if not os.environ.get("SCAN_DATA"):
        return
    for name in REAL:
        for what, mistake, made in variants(name):
            found = finding_of(made)
            yield RealNamed(
                name,
                what,
                mistake,
                None if found is None else Mistake(found.code),
                "" if found is None else found.message,
            )
