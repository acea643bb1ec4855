"""How sharp a board is in an image, and how much of it light has washed out. Pure.

Measured on the edges between black and white squares, half way between two corners: a blurred edge is wide, a washed-out
one has no contrast. Both spoil corners before they keep the board from being found.
"""

from dataclasses import dataclass
from typing import Final, assert_never

import cv2
import numpy as np

from phone_host.calibration.target.corner_fit import Floats
from phone_host.calibration.target.corners import Board, Corners
from phone_host.calibration.target.marked import AprilGrid, Charuco, is_mirrored
from phone_host.model import Image, Side

_REACH: Final = 0.35
"""How far an edge is followed to both sides, in sides of a square."""

_TAG_BORDER: Final = 1 / 8
"""The narrowest black border of an AprilTag, in sides of the tag."""

_WITHIN: Final = 0.9
"""Share of a mark's margin up to which an edge is followed: a mark inside a white square is no light."""

_SAMPLES: Final = 41
_FAINT: Final = 0.4
"""An edge with less than this share of the usual contrast is washed out."""

_BRIGHT: Final = 250
_LEAST_CONTRAST: Final = 10.0


@dataclass(frozen=True, slots=True)
class BoardLook:
    """What an image looks like.

    Attributes:
        edge_px: width of the edges between squares, in the direction in which they are wider, px; NaN: no board was found.
        washed: share of the edges that have lost their contrast, 0 to 1; NaN: no board was found.
        bright: share of the image that is as bright as it can be, 0 to 1.
        is_mirrored: whether the board's marks are seen in the mirrored image only.
    """

    edge_px: float
    washed: float
    bright: float
    is_mirrored: bool = False


@dataclass(frozen=True, slots=True)
class SeenLook:
    """How one image looks: its file, its side, and the look."""

    name: str
    side: Side
    look: BoardLook


def look_at(grey: Image, corners: Corners, board: Board) -> BoardLook:
    """Measure an image."""
    bright = float((grey >= _BRIGHT).mean())
    if len(corners) == 0:
        marks = board.marks
        mirrored = marks is not None and is_mirrored(grey, board.columns, board.rows, marks)
        return BoardLook(float("nan"), float("nan"), bright, mirrored)
    grid = corners.reshape(board.rows, board.columns, 2)
    widths, contrasts = [], []
    reaches = _reaches(grid, board)
    for before, after, reach in ((grid[:, :-1], grid[:, 1:], reaches[0]), (grid[:-1], grid[1:], reaches[1])):
        starts, ends = before.reshape(-1, 2), after.reshape(-1, 2)
        seen = np.isfinite(starts).all(axis=1) & np.isfinite(ends).all(axis=1)
        if not seen.any():
            continue
        width, contrast = _edges(grey, starts[seen], ends[seen], reach)
        usual = float(np.median(contrast))
        clear = contrast > max(_FAINT * usual, _LEAST_CONTRAST)
        widths.append(float(np.median(width[clear])) if clear.any() else float("nan"))
        contrasts.append(contrast)
    if not contrasts:
        return BoardLook(float("nan"), float("nan"), bright)
    together = np.concatenate(contrasts)
    # Half of the edges may be washed out: what is usual is told by the better ones.
    usual = float(np.percentile(together, 75))
    return BoardLook(float(np.nanmax(widths)), float((together < _FAINT * usual).mean()), bright)


def _reaches(grid: Floats, board: Board) -> tuple[float, float]:
    """Return how far edges along the rows and along the columns are followed, in their own lengths.

    A tilted board is narrower one way: beside its longer edges the marks are nearer.
    """
    reach = _reach(board)
    if board.marks is None:
        return reach, reach
    across, down = (np.linalg.norm(np.diff(grid, axis=axis), axis=2) for axis in (1, 0))
    if not np.isfinite(across).any() or not np.isfinite(down).any():
        return reach, reach
    ratio = float(np.nanmedian(down) / np.nanmedian(across))
    return reach * min(1.0, ratio), reach * min(1.0, 1 / ratio)


def _reach(board: Board) -> float:
    """Return how far an edge of a board is followed to both sides, in sides of a square: not into its marks."""
    match board.marks:
        case None:
            return _REACH
        case Charuco(mark_share=share):
            return min(_REACH, _WITHIN * (1 - share) / 2)
        case AprilGrid():
            return _WITHIN * _TAG_BORDER
        case _:
            assert_never(board.marks)


def _edges(grey: Image, starts: Floats, ends: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return width, px, and contrast of the edges between corners that lie beside each other, (M,) each."""
    along = ends - starts
    across = np.column_stack([-along[:, 1], along[:, 0]])
    offsets = np.linspace(-reach, reach, _SAMPLES)
    at = (starts + ends)[:, np.newaxis] / 2 + offsets[:, np.newaxis] * across[:, np.newaxis]
    where = at.astype(np.float32)
    profile = np.asarray(cv2.remap(grey, where, np.empty(0), cv2.INTER_LINEAR), np.float64)
    ends_of = max(1, _SAMPLES // 8)
    contrast = np.abs(profile[:, :ends_of].mean(axis=1) - profile[:, -ends_of:].mean(axis=1))
    step_px = np.linalg.norm(along, axis=1) * 2 * reach / (_SAMPLES - 1)
    steepest = np.abs(profile[:, 2:] - profile[:, :-2]).max(axis=1) / (2 * step_px)
    return contrast / np.maximum(steepest, 1e-9), contrast
