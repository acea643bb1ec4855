"""Boards with coded marks, of which a part is enough: ChArUco boards and AprilGrids. Their corners in an image. Pure.

Each corner is known by the marks beside it, so no view is ambiguous, and what is hidden is NaN. Corners are those of the
chessboard, or where the tags of an AprilGrid touch the small black squares between them: saddle points, which an edge of
light does not shift. The marks' own corners only say where to look: they lie half a pixel inside the mark.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corner_fit import fit_corners
from phone_host.calibration.target.small_picture import shrunk
from phone_host.model import Image

Corners = NDArray[np.float64]

_SEARCHED_PX: Final = 1600
"""Longer side: marks are read in an image no larger; corners are refined in the whole one."""

_MOST_ENLARGED: Final = 2.0

_CELL_PX, _CELL_RIM = 8, 0.3
"""Each bit of a tag is looked at in so many pixels, and told by its middle: blur mixes its rim, this share of it, with its neighbours."""

LEAST_SEEN: Final = 8
"""Fewer corners hardly determine where the board is: two marks may give four in a line."""

_REACH_SHARE: Final = 0.5
"""Of the clear space beside an edge, both sides together, before a mark begins."""

_NEIGHBOURS: Final = 9
_ASTRAY: Final = 0.02
"""Share of the distance to the next corners: a lens bends the small piece of board around a corner by far less. At least half a pixel."""

_LEAST_ASTRAY_PX: Final = 0.5


class MarkFamily(Enum):
    """A family of coded marks; the value is OpenCV's number of it."""

    ARUCO_4X4 = cv2.aruco.DICT_4X4_1000
    ARUCO_5X5 = cv2.aruco.DICT_5X5_1000
    ARUCO_6X6 = cv2.aruco.DICT_6X6_1000
    APRILTAG_36H11 = cv2.aruco.DICT_APRILTAG_36h11


@dataclass(frozen=True, slots=True)
class Charuco:
    """The marks of a ChArUco board.

    Attributes:
        family: their family.
        mark_share: side of a mark as a share of a square's side.
        is_legacy: whether they are arranged as OpenCV did before 4.6, and calib.io does: with an even number of rows the
            upper left square is white and holds a mark. Boards with an odd number of rows are the same in both.
    """

    family: MarkFamily
    mark_share: float
    is_legacy: bool = False


@dataclass(frozen=True, slots=True)
class AprilGrid:
    """The tags of an AprilGrid, four corners each: the gap between two tags as a share of a tag's side."""

    gap_share: float


Marks = Charuco | AprilGrid


def grid_lines(count: int, marks: AprilGrid) -> Corners:
    """Return where the corners of an AprilGrid lie along one of its sides, (count,), in sides of a tag; two for each tag."""
    tag = np.arange(count) // 2
    return np.asarray(tag * (1 + marks.gap_share) + np.arange(count) % 2, np.float64)


def find_marked(grey: Image, columns: int, rows: int, marks: Marks) -> Corners:
    """Find the corners of a board with marks.

    Returns:
        (columns * rows, 2) px, row by row, NaN where one is not seen; (0, 2) if fewer than eight are.
    """
    found = marked_corners(grey, columns, rows, marks)
    found[_astray(found, plan_of(columns, rows, marks))] = np.nan
    return found if np.isfinite(found[:, 0]).sum() >= LEAST_SEEN else np.empty((0, 2))


def marked_corners(grey: Image, columns: int, rows: int, marks: Marks) -> Corners:
    """Find the corners of a board with marks, without asking whether they fit their neighbours: for those who fit a pose to them.

    Returns:
        (columns * rows, 2) px, row by row, NaN where one is not seen.
    """
    small, factors = shrunk(grey, min(1.0, _SEARCHED_PX / max(grey.shape)))
    rough, share = (
        (_charuco(small, columns, rows, marks), 1 - marks.mark_share)
        if isinstance(marks, Charuco)
        else (_april_grid(small, columns, rows), marks.gap_share)
    )
    found, seen = np.full((columns * rows, 2), np.nan), np.isfinite(rough).all(axis=1)
    if seen.sum() < LEAST_SEEN:
        return found
    whole = (rough[seen] + 0.5) / factors - 0.5
    along, down = _steps(plan_of(columns, rows, marks)[seen], whole, share)
    known = np.isfinite(along[:, 0])
    if known.any():
        fitted = fit_corners(grey, whole[known], along[known], down[known], _REACH_SHARE)
        found[np.flatnonzero(seen)[known]] = np.where(fitted.are_sure()[:, np.newaxis], fitted.px, np.nan)
    return found


def _steps(plan: Corners, found: Corners, length: float) -> tuple[Corners, Corners]:
    """Return steps of a length on the board from each corner along its rows and columns, (N, 2) px each: they end before the next mark.

    Each piece of board is seen as its nearest corners show it. NaN where those lie in one line.
    """
    steps = np.full((2, len(plan), 2), np.nan)
    for index, place in enumerate(plan):
        near = np.argsort(np.linalg.norm(plan - place, axis=1))[1 : 1 + _NEIGHBOURS]
        view, _, rank, _ = np.linalg.lstsq(plan[near] - place, found[near] - found[index], rcond=1e-6)
        if rank == 2:
            steps[:, index] = view * length
    return steps[0], steps[1]


def plan_of(columns: int, rows: int, marks: Marks) -> Corners:
    """Return where the corners lie on the board, (columns * rows, 2), in sides of a square or of a tag."""
    x, y = (
        grid_lines(count, marks) if isinstance(marks, AprilGrid) else np.arange(count, dtype=np.float64)
        for count in (columns, rows)
    )
    return np.column_stack([each.ravel() for each in np.meshgrid(x, y)])


def _astray(found: Corners, plan: Corners) -> NDArray[np.bool_]:
    """Return which corners are not where their neighbours say: the edge of a hand has drawn them away."""
    astray = np.zeros(len(found), np.bool_)
    seen = np.flatnonzero(np.isfinite(found).all(axis=1))
    if len(seen) <= LEAST_SEEN:
        return astray
    for index in seen:
        distance = np.linalg.norm(plan[seen] - plan[index], axis=1)
        near = seen[np.argsort(distance)[1 : 1 + _NEIGHBOURS]]
        view, _ = cv2.findHomography(plan[near], found[near], cv2.LMEDS)
        if np.ndim(view) == 0:  # they lie in one line
            continue
        told = np.asarray(cv2.perspectiveTransform(plan[index][np.newaxis, np.newaxis], view)).reshape(2)
        spacing = float(np.median(np.linalg.norm(found[near] - found[index], axis=1)))
        astray[index] = np.linalg.norm(told - found[index]) > max(_LEAST_ASTRAY_PX, _ASTRAY * spacing)
    return astray


def is_mirrored(grey: Image, columns: int, rows: int, marks: Marks) -> bool:
    """Return whether the board is seen in the mirrored image. Marks are never read in a mirror."""
    return len(find_marked(np.ascontiguousarray(grey[:, ::-1]), columns, rows, marks)) > 0


def _charuco(grey: Image, columns: int, rows: int, marks: Charuco) -> Corners:
    """Return corners, NaN where not seen."""
    every = cv2.aruco.getPredefinedDictionary(marks.family.value)
    # Its own marks only: to compare each square with all thousand takes longer than all the rest.
    own = np.ascontiguousarray(every.bytesList[: (columns + 1) * (rows + 1) // 2])
    dictionary = cv2.aruco.Dictionary(own, every.markerSize, every.maxCorrectionBits)
    board = cv2.aruco.CharucoBoard((columns + 1, rows + 1), 1.0, marks.mark_share, dictionary)
    board.setLegacyPattern(marks.is_legacy)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(grey)
    found = np.full((columns * rows, 2), np.nan)
    if np.ndim(corners) == 0 or len(corners) == 0:  # OpenCV gives None where there is nothing
        return found
    found[np.asarray(ids).ravel()] = np.asarray(corners, np.float64).reshape(-1, 2)
    return found


def _april_grid(grey: Image, columns: int, rows: int) -> Corners:
    across, down = columns // 2, rows // 2
    tags = _tags(grey, across * down)
    grid = np.full((rows, columns, 2), np.nan)
    upward = _is_upward(tags, across)
    for number, corners in tags.items():
        row, column = divmod(number, across)
        top, left = 2 * (down - 1 - row if upward else row), 2 * column
        grid[top, left], grid[top, left + 1] = corners[0], corners[1]
        grid[top + 1, left + 1], grid[top + 1, left] = corners[2], corners[3]
    return grid.reshape(-1, 2)


def _tags(grey: Image, most: int) -> dict[int, Corners]:
    """Return the four corners of each tag, clockwise from its upper left one. Kalibr prints tags with a border of two bits, others of one."""
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.APRILTAG_36H11.value)
    parted, factor = _parted(grey)
    read = dict[int, Corners]()
    for border in (2, 1):  # read with the wrong one, a tag may pass for another
        parameters = cv2.aruco.DetectorParameters()
        parameters.markerBorderBits = border
        parameters.perspectiveRemovePixelPerCell, parameters.perspectiveRemoveIgnoredMarginPerCell = _CELL_PX, _CELL_RIM
        corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(parted)
        if len(corners) > len(read):
            numbers = [int(number) for number in np.asarray(ids).ravel()]
            read = {
                number: (np.asarray(four, np.float64).reshape(4, 2) + 0.5) / factor - 0.5
                for number, four in zip(numbers, corners, strict=True)
                if number < most
            }
    return read


def _parted(grey: Image) -> tuple[Image, float]:
    """Return an image in which tags and the squares that they touch are apart, and how much larger it is.

    Where they touch, blur joins them, and no tag has an outline of its own. So white is widened by a pixel, in an image of up to twice
    the size: tags are read twice as far away.
    """
    factor = float(np.clip(_SEARCHED_PX / max(grey.shape), 1.0, _MOST_ENLARGED))
    large = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    return np.asarray(cv2.dilate(large, np.ones((3, 3), np.uint8))), factor


def _is_upward(tags: dict[int, Corners], across: int) -> bool:
    """Return whether rows are numbered from the lowest one, as Kalibr does: the next row's tag lies above, seen by the tag itself."""
    votes = 0
    for number, corners in tags.items():
        if number + across in tags:
            down = corners[3] - corners[0]
            votes += 1 if (tags[number + across].mean(axis=0) - corners.mean(axis=0)) @ down < 0 else -1
    return votes > 0
