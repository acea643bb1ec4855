"""Real rigs for bench_calibration: their board views, calibrated by ours and by OpenCV's stereo_calib recipe.

The unlike variant makes two unlike cameras out of each: the right images are cropped off-centre, scaled by 0.6, re-exposed
and recompressed at JPEG quality 75.
"""

import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.fitted_rig import square_sides_m
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import Board, agree, find_corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import Image

Change = Callable[[Image], Image]


@dataclass(frozen=True, slots=True)
class RealRig:
    """Where a rig's views lie, and its board."""

    name: str
    folder: str
    left: str
    right: str
    board: Board
    spoiled: frozenset[int] = frozenset()

    def pairs(self) -> Iterator[tuple[int, Path, Path]]:
        """Give number, left file and right file of each pair."""
        root = Path(os.environ["SCAN_DATA"]) / self.folder
        right = {_number(path): path for path in root.glob(self.right)}
        for path in sorted(root.glob(self.left), key=_number):
            yield _number(path), path, right[_number(path)]


RIGS: Final = (
    RealRig("opencv", "opencv_stereo_calib", "left*.jpg", "right*.jpg", Board(9, 6, 0.025)),
    RealRig("simplestereo", "simplestereo_rig1/calib", "*_L.png", "*_R.png", Board(7, 6, 0.0605)),
    RealRig("stereopi", "stereopi_rig/pairs", "left_*.png", "right_*.png", Board(9, 6, 0.025), frozenset({13, 15, 28})),
    RealRig("sourishg", "sourishg_rig/calib_imgs/1", "left[0-9]*.jpg", "right[0-9]*.jpg", Board(9, 6, 0.025)),
)

SCALE: Final = 0.6
CROP: Final = (0.05, 0.0, 1.0, 0.96)
"""Left, top, right and bottom edge of what is kept, as shares of the image: off-centre, and of another shape."""

_QUALITY: Final = 75
_PARTS: Final = 5


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """What both detectors found in one rig's images.

    Attributes:
        ours: pairs by our search.
        theirs: pairs by the recipe's search.
        sizes_px: of the left and right images.
        our_seconds: our search in all images.
        their_seconds: the recipe's.
        count: pairs looked at.
    """

    ours: list[BoardPair]
    theirs: list[BoardPair]
    sizes_px: tuple[tuple[int, int], tuple[int, int]]
    our_seconds: float
    their_seconds: float
    count: int


@dataclass(frozen=True, slots=True)
class Recipe:
    """The recipe's answer: the figures that are compared."""

    used: int
    rms_px: float
    baseline_m: float
    vertical_p95_px: float
    seconds: float


def unlike(image: Image) -> Image:
    """Make another camera of the right one: cropped off-centre, scaled by 0.6, darker with another gamma, JPEG at quality 75."""
    height, width = image.shape[:2]
    x0, y0, x1, y1 = (round(share * length) for share, length in zip(CROP, (width, height) * 2, strict=True))
    cropped = image[y0:y1, x0:x1]
    size = (round(cropped.shape[1] * SCALE), round(cropped.shape[0] * SCALE))
    small = cv2.resize(cropped, size, interpolation=cv2.INTER_AREA)
    exposed = np.rint(255 * (small / 255.0) ** 1.25 * 0.8).astype(np.uint8)
    coded = cv2.imencode(".jpg", exposed, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8)


def corners_of(rig: RealRig, change: Change | None = None) -> Corners:
    """Find the board in all images of a rig, by both ways.

    Args:
        rig: the rig.
        change: what is done to the right images.
    """
    ours, theirs, sizes = list[BoardPair](), list[BoardPair](), [(0, 0), (0, 0)]
    seconds, count = [0.0, 0.0], 0
    for number, *paths in rig.pairs():
        images = [np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8) for path in paths]
        images[1] = images[1] if change is None else change(images[1])
        sizes = [(image.shape[1], image.shape[0]) for image in images]
        count += 1
        for index, (search, found) in enumerate(((find_corners, ours), (_recipes_corners, theirs))):
            began = time.perf_counter()
            left, right = (search(image, rig.board) for image in images)
            seconds[index] += time.perf_counter() - began
            if len(left) and len(right):
                found.append(BoardPair(str(number), left, agree(left, right, rig.board)))
    return Corners(ours, theirs, (sizes[0], sizes[1]), seconds[0], seconds[1], count)


def ours(rig: RealRig, corners: Corners) -> tuple[Calibration, float]:
    """Calibrate by ours; return it and its seconds, without the search."""
    began = time.perf_counter()
    found = calibrate(corners.ours, rig.board, corners.sizes_px)
    return found, time.perf_counter() - began


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Squares of boards that a rig was not fitted to.

    Attributes:
        scale_share: root mean square over the views of (mean side / true side - 1).
        scatter_share: deviation of sides within a view / true side, root mean square over the views.
    """

    scale_share: float
    scatter_share: float


def held_out(rig: RealRig, corners: Corners, common: frozenset[str]) -> HeldOut:
    """Measure the squares of every fifth pair by a rig that was fitted, lenses chosen and all, to the others; five times.

    Args:
        rig: the rig.
        corners: of its pairs.
        common: names of the pairs that count.
    """
    points, true_m = rig.board.points_m(), rig.board.square_m
    sides = []
    for part in range(_PARTS):
        held = [pair for pair in corners.ours[part::_PARTS] if pair.name in common]
        rest = [pair for index, pair in enumerate(corners.ours) if index % _PARTS != part]
        made = calibrate(rest, rig.board, corners.sizes_px).rig
        sides += [square_sides_m([pair], points, made) / true_m for pair in held]
    return HeldOut(
        scale_share=float(np.sqrt(np.mean([(each.mean() - 1) ** 2 for each in sides]))),
        scatter_share=float(np.sqrt(np.mean([each.var() for each in sides]))),
    )


@dataclass(frozen=True, slots=True)
class Spoiled:
    """What our solver makes of OpenCV's own corners where its search spoils some views: see `opencvs_pairs`.

    Attributes:
        views: their numbers.
        found: the views that our solver rejects.
        used: the views that it uses.
        baseline_mm: ours from those.
        recipe_mm: the recipe's from the same.
    """

    views: tuple[int, ...]
    found: tuple[int, ...]
    used: int
    baseline_mm: float
    recipe_mm: float


def spoiled(rig: RealRig) -> Spoiled:
    """Feed OpenCV's own corners of all views to our solver.

    Args:
        rig: the rig, which names the views that OpenCV's search spoils.
    """
    pairs, sizes_px = opencvs_pairs(rig)
    ours_of = calibrate(pairs, rig.board, sizes_px)
    used = {each.name for each in ours_of.used}
    beside = recipe(rig.board, [pair for pair in pairs if pair.name in used], sizes_px, to_its_end=True)
    return Spoiled(
        views=tuple(sorted(rig.spoiled)),
        found=tuple(sorted(int(each.name) for each in ours_of.rejected)),
        used=len(used),
        baseline_mm=float(np.linalg.norm(ours_of.rig.t_right_left_m)) * 1e3,
        recipe_mm=beside.baseline_m * 1e3,
    )


def opencvs_pairs(rig: RealRig) -> tuple[list[BoardPair], tuple[tuple[int, int], tuple[int, int]]]:
    """Return the corners of all views by `findChessboardCorners` and `cornerSubPix`, and the images' sizes.

    With windows of 7 px, as squares of 10 px ask for, three right views of stereopi_rig jump by 3 to 16 px; with the usual 23 px nearly all views do.
    """
    pairs, sizes = list[BoardPair](), [(0, 0), (0, 0)]
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
    for number, *paths in rig.pairs():
        images = [np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8) for path in paths]
        sizes = [(image.shape[1], image.shape[0]) for image in images]
        seen = []
        for image in images:
            found, rough = cv2.findChessboardCorners(image, (rig.board.columns, rig.board.rows))
            if found:
                refined = cv2.cornerSubPix(image, np.asarray(rough, np.float32), (3, 3), (-1, -1), until)
                seen.append(np.asarray(refined, np.float64).reshape(-1, 2))
        if len(seen) == len(images):
            pairs.append(BoardPair(str(number), seen[0], agree(seen[0], seen[1], rig.board)))
    return pairs, (sizes[0], sizes[1])


def recipe(
    board: Board,
    pairs: Sequence[BoardPair],
    sizes_px: tuple[tuple[int, int], tuple[int, int]],
    *,
    to_its_end: bool = False,
) -> Recipe:
    """OpenCV's samples/cpp/stereo_calib.cpp. It takes one image size; unlike cameras are calibrated alone first, then held fixed.

    Args:
        board: the board.
        pairs: corners.
        sizes_px: of the left and right images.
        to_its_end: the recipe's 100 steps may end far from its optimum (stereopi, 27 views: 56.0 mm, but 57.4 mm without any one of
            ten views); let it go on for 300.
    """
    began = time.perf_counter()
    points = [board.points_m().astype(np.float32)] * len(pairs)
    left, right = (
        [np.asarray(getattr(pair, side), np.float32).reshape(-1, 1, 2) for pair in pairs]
        for side in ("left_px", "right_px")
    )
    limits = (300, 1e-7) if to_its_end else (100, 1e-5)
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, *limits)
    fix = cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K4 | cv2.CALIB_FIX_K5
    usual = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_RATIONAL_MODEL | fix
    if sizes_px[0] == sizes_px[1]:
        start = [
            cv2.initCameraMatrix2D(points, seen, size, 0) for seen, size in zip((left, right), sizes_px, strict=True)
        ]
        flags = usual | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_SAME_FOCAL_LENGTH
        lenses = [np.zeros(8), np.zeros(8)]
    else:
        alone = [
            cv2.calibrateCamera(points, seen, size, None, None, flags=usual, criteria=until)
            for seen, size in zip((left, right), sizes_px, strict=True)
        ]
        start, lenses = [each[1] for each in alone], [np.asarray(each[2], np.float64) for each in alone]
        flags = usual | cv2.CALIB_FIX_INTRINSIC
    rms, k1, d1, k2, d2, rotation, translation, *_ = cv2.stereoCalibrate(
        points, left, right, start[0], lenses[0], start[1], lenses[1], sizes_px[0], flags=flags, criteria=until
    )
    seconds = time.perf_counter() - began
    r1, r2, p1, p2, *_ = cv2.stereoRectify(k1, d1, k2, d2, sizes_px[0], rotation, translation, alpha=0)
    rows = [
        cv2.undistortPoints(seen, k, d, R=r, P=p)[:, 0, 1]
        for pair in zip(left, right, strict=True)
        for seen, k, d, r, p in ((pair[0], k1, d1, r1, p1), (pair[1], k2, d2, r2, p2))
    ]
    off = np.abs(np.array(rows[::2]) - np.array(rows[1::2]))
    return Recipe(len(pairs), float(rms), float(np.linalg.norm(translation)), float(np.percentile(off, 95)), seconds)


def _recipes_corners(image: Image, board: Board) -> NDArray[np.float64]:
    """The recipe's search: at full size, then at twice that."""
    for scale in (1, 2):
        searched = image if scale == 1 else cv2.resize(image, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR_EXACT)
        found, corners = cv2.findChessboardCorners(searched, (board.columns, board.rows))
        if found:
            until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
            start = np.asarray(corners, np.float32) / scale
            refined = cv2.cornerSubPix(image, start, (11, 11), (-1, -1), until)
            return np.asarray(refined, np.float64).reshape(-1, 2)
    return np.empty((0, 2))


def _number(path: Path) -> int:
    return int(re.findall(r"\d+", path.name)[-1])
