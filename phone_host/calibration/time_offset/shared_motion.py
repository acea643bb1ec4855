"""Measures the time offset from a moving scene that a calibrated rig films: the offset at which both cameras see every point in one row.

In rectified images a point has the same row in both. Where it moves up or down with velocity w, images taken dt apart
differ in the row by w dt. The stamps account only for s of dt: row difference = w (s - offset) + c, where c is what the
rig's calibration leaves. So a straight line through the row differences of many features over their velocities has the
offset as its slope; no image is interpolated. Motion along the rows says nothing, because it looks like depth.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.frame import SpoiledImageError
from phone_host.calibration.time_offset.shots import (
    SIGMAS,
    Measured,
    Method,
    Shot,
    require_shots,
    rolling_s,
    to_seconds,
)
from phone_host.model import UNMEASURED_NS, Image, Side, TimeOffset
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from phone_host.stereo.working import lying_pair

_FEATURES: Final = 500
_MOVING, _STILL = 60, 10
"""Features per image that are searched in the other camera's; those at rest only say how well the rig's rows agree."""

_NEAR_M: Final = 0.4
_HALF: Final = 8
_ROWS: Final = 15
"""Half of a patch's side, and the largest difference of rows, px: 1 m/s at 1 m and 500 px focal length, seen 30 ms late."""

_MATCH_PX: Final = 0.05
"""A patch's position is biased by this much towards whole pixels, whatever the number of patches (Shimizu and Okutomi, 2001)."""

_ALIKE: Final = 0.85
_BEND_PX: Final = 2.0
_DRAWS: Final = 400
_WINDOW: Final = (21, 21)
_LEVELS: Final = 3
_BACK_PX: Final = 0.5
"""A feature is lost if tracking it there and back ends farther than this from its start."""

_LARGEST_ROW_PX: Final = 15.0

_MOVES_PX_S: Final = 25.0
"""Slower motion says less than the bias of a patch: 0.05 px at 25 px/s are 2 ms."""

_LEAST_MOVING: Final = 60
_LEAST_INSTANTS: Final = 8
"""Least number of moments at which something moves up or down. Features in one image share their errors, so moments count, not features."""

_MOST_INSTANTS: Final = 150
_SEARCH_S: Final = 0.1
_HUBER_PX: Final = 0.5
_REMEDY: Final = "move something with texture up and down, quickly, in view of both cameras"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rows:
    """Features seen by both cameras.

    Attributes:
        velocity_px_s: (N,) how fast each moves down the left rectified image.
        difference_px: (N,) its row in the right image minus its row in the left.
        stamps_s: (N,) stamp of the right image minus that of the left.
        instant: (N,) the left image in which it was found.
        row: (N,) its position in that image, 0 top to 1 bottom.
    """

    velocity_px_s: NDArray[np.float64]
    difference_px: NDArray[np.float64]
    stamps_s: NDArray[np.float64]
    instant: NDArray[np.int64]
    row: NDArray[np.float64]


ReadImage = Callable[[Shot], Image]


def measure_shared_motion(
    board: Sequence[Shot], host: Sequence[Shot], rectifier: Rectifier, look: ReadImage, advance: Callable[[float], None]
) -> Measured:
    """Measure the time offset.

    Args:
        board: shots of the board's camera, in order.
        host: shots of the host's camera, in order.
        rectifier: of the rig.
        look: decodes a shot.
        advance: called with the share that is done, 0 to 1.

    Raises:
        DataError: the recording is too short, or nothing moved up or down.
    """
    require_shots(len(board), len(host))
    board_is_left = rectifier.rig.board_side is Side.LEFT
    left, right = (board, host) if board_is_left else (host, board)
    first = _rows(
        left=left, right=right, offset_s=0.0, rectifier=rectifier, look=look, advance=lambda share: advance(share / 2)
    )
    coarse_s, _ = _slope(first)
    # With the first answer, compare the images that really are nearest in time.
    rows = _rows(
        left=left,
        right=right,
        offset_s=coarse_s,
        rectifier=rectifier,
        look=look,
        advance=lambda share: advance((1 + share) / 2),
    )
    offset_s, uncertainty_s = _slope(rows)
    weights = rows.velocity_px_s**2
    period = (left[-1].exposed_ns - left[0].exposed_ns) / 1e9 / (len(left) - 1)
    # Unlike sensors read equal rows at different times: add what that comes to if the motion was not in the middle of
    # the image.
    uncertainty_s += rolling_s(float((rows.row * weights).sum() / weights.sum()), period)
    uncertainty_s += _MATCH_PX / math.sqrt(float(weights.mean()))
    if uncertainty_s * 1e9 > UNMEASURED_NS / 2:
        raise DataError(
            f"too little motion up or down: +- {uncertainty_s * 1e3:.0f} ms is no better than unmeasured", _REMEDY
        )
    sign = 1.0 if board_is_left else -1.0  # right minus left is host minus board, or the other way round
    offsets = np.linspace(offset_s - _SEARCH_S, offset_s + _SEARCH_S, 201)
    misfits = np.array([_error_px(rows, float(offset)) for offset in offsets])
    offset = TimeOffset(round(sign * offset_s * 1e9), max(1, round(uncertainty_s * 1e9)))
    order = slice(None) if board_is_left else slice(None, None, -1)
    return Measured(
        offset, Method.SCENE, len(rows.velocity_px_s), sign * offsets[order], misfits[order], "epipolar error, RMS px"
    )


def _rows(
    *,
    left: Sequence[Shot],
    right: Sequence[Shot],
    offset_s: float,
    rectifier: Rectifier,
    look: ReadImage,
    advance: Callable[[float], None],
) -> Rows:
    """Track features through three left images, and find them in the right image nearest in time to the middle one."""
    left_s, right_s, _ = to_seconds([shot.exposed_ns for shot in left], [shot.exposed_ns for shot in right])
    step = max(1, (len(left) - 2) // _MOST_INSTANTS)
    middles = range(1, len(left) - 1, step)
    made = rectifier.rectification
    along_px = made.height_px if made.epipolar.is_vertical else made.width_px
    reach_px = disparities_for_near(rectifier.geometry, _NEAR_M, along_px)
    parts: list[NDArray[np.float64]] = []
    for done, middle in enumerate(middles):
        advance(done / len(middles))
        nearest = int(np.abs(right_s - left_s[middle] - offset_s).argmin())
        seconds = left_s[middle + 1] - left_s[middle - 1]
        late_s = right_s[nearest] - left_s[middle]
        if abs(late_s - offset_s) > seconds:
            continue  # frames were lost
        try:
            other = look(right[nearest])
            upright = (rectifier.rectify(look(left[at]), other) for at in (middle - 1, middle, middle + 1))
            pairs = [lying_pair(pair) for pair in upright]
        except SpoiledImageError:
            continue  # as good as lost
        before, now, after = (_grey(pair.left) for pair in pairs)
        found = _compare(before, now, after, _grey(pairs[1].right), seconds=seconds, reach_px=reach_px)
        rest = np.broadcast_to([late_s, middle], (len(found), 2))
        parts.append(np.column_stack([found, rest]))
    table = np.concatenate(parts) if parts else np.empty((0, 5))
    moving = np.abs(table[:, 0]) > _MOVES_PX_S
    if moving.sum() < _LEAST_MOVING or len(np.unique(table[moving, 4])) < _LEAST_INSTANTS:
        raise DataError("no motion up or down was seen by both cameras", _REMEDY)
    return Rows(
        velocity_px_s=table[:, 0],
        difference_px=table[:, 1],
        stamps_s=table[:, 3],
        instant=table[:, 4].astype(np.int64),
        row=table[:, 2],
    )


def _grey(image: Image) -> Image:
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _compare(
    before: Image, now: Image, after: Image, right: Image, *, seconds: float, reach_px: int
) -> NDArray[np.float64]:
    """Return (N, 3): each feature's downward velocity, px/s, its row in `right` minus that in `now`, px, and its row, 0 to 1."""
    corners: Any = cv2.goodFeaturesToTrack(now, _FEATURES, 0.01, 6)  # the stubs do not know that it may be None
    if corners is None:
        return np.empty((0, 3))
    points = np.asarray(corners, dtype=np.float32).reshape(-1, 2)
    (back, was_there), (on, is_there) = _follow(now, before, points), _follow(now, after, points)
    velocity = (on - back)[:, 1] / seconds
    steady = np.abs(on + back - 2 * points).max(axis=1) < _BEND_PX  # else its velocity in the middle differs
    usable = was_there & is_there & steady
    moving = usable & (np.abs(velocity) > _MOVES_PX_S)
    chosen = np.concatenate([np.flatnonzero(moving)[:_MOVING], np.flatnonzero(usable & ~moving)[:_STILL]])
    height = now.shape[0]
    rows = [(velocity[i], _row_difference(now, right, points[i], reach_px), points[i, 1] / height) for i in chosen]
    return np.array([row for row in rows if not math.isnan(row[1])]).reshape(-1, 3)


def _follow(source: Image, target: Image, points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return where features of one image are in another one, (N, 2), and whether that can be believed."""
    there, found = _tracked(source, target, points)
    home, found_home = _tracked(target, source, there)
    return there, found & found_home & (np.abs(home - points).max(axis=1) < _BACK_PX)


def _tracked(
    source: Image, target: Image, points: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    there, found, _ = cv2.calcOpticalFlowPyrLK(source, target, points, points.copy(), winSize=_WINDOW, maxLevel=_LEVELS)
    return np.asarray(there, dtype=np.float32), np.asarray(found).ravel() > 0


def _row_difference(left: Image, right: Image, point: NDArray[np.float32], reach_px: int) -> float:
    """Return a feature's row in the right image minus that in the left, by normalised correlation of its surroundings; NaN: not found."""
    x, y = round(float(point[0])), round(float(point[1]))
    height, width = left.shape
    if not (_HALF + _ROWS <= y < height - _HALF - _ROWS and _HALF <= x < width - _HALF):
        return math.nan
    patch = left[y - _HALF : y + _HALF + 1, x - _HALF : x + _HALF + 1]
    x0 = max(0, x - _HALF - reach_px)
    strip = right[y - _HALF - _ROWS : y + _HALF + _ROWS + 1, x0 : min(width, x + _HALF + 3)]
    scores = cv2.matchTemplate(strip, patch, cv2.TM_CCOEFF_NORMED)
    _, best, _, (column, row) = cv2.minMaxLoc(scores)
    if best < _ALIKE or not 0 < row < 2 * _ROWS:
        return math.nan
    above, here, below = (float(scores[row + step, column]) for step in (-1, 0, 1))
    bend = above - 2 * here + below
    return row - _ROWS + (0.5 * (above - below) / bend if bend < 0 else 0.0)


def _slope(rows: Rows) -> tuple[float, float]:
    """Return the offset and its uncertainty, s: Huber's regression, and the scatter of its results when whole instants are resampled."""
    design = np.column_stack([-rows.velocity_px_s, np.ones(len(rows.velocity_px_s))])
    target = rows.difference_px - rows.velocity_px_s * rows.stamps_s
    weights = np.ones(len(target))
    answer: NDArray[np.float64] = np.zeros(2)
    for _ in range(20):
        answer = np.asarray(
            np.linalg.lstsq(design * weights[:, None], target * weights, rcond=None)[0], dtype=np.float64
        )
        weights = np.sqrt(np.minimum(1.0, _HUBER_PX / np.maximum(np.abs(target - design @ answer), 1e-9)))
    # With fixed weights, an instant's part of the normal equations is a 2 x 2 matrix, so resampling instants means
    # adding those up.
    instants = np.unique(rows.instant)
    weighted, wanted = design * weights[:, None], target * weights
    parts = [
        (weighted[at].T @ weighted[at], weighted[at].T @ wanted[at]) for at in (rows.instant == i for i in instants)
    ]
    squares, products = np.array([part[0] for part in parts]), np.array([part[1] for part in parts])
    chance = np.random.default_rng(1)
    drawn = chance.multinomial(len(instants), np.full(len(instants), 1 / len(instants)), size=_DRAWS)
    answers = np.array([np.linalg.lstsq(np.tensordot(n, squares, 1), n @ products, rcond=None)[0][0] for n in drawn])
    return float(answer[0]), SIGMAS * float(answers.std())


def _error_px(rows: Rows, offset_s: float) -> float:
    """Return the RMS row difference that is left at an offset, with large ones cut off, px."""
    left = rows.difference_px - rows.velocity_px_s * (rows.stamps_s - offset_s)
    left = left - np.median(left)
    return float(np.sqrt(np.mean(np.minimum(np.abs(left), _LARGEST_ROW_PX) ** 2)))
