"""Finds out whether two folders of pictures without numbers are out of step, because pictures are missing on one side. Pure.

Both sides are taken in the order of their names. From the first picture that is missing on, each pair shows two moments.
The pair of pictures, up to as many places apart as are missing, whose rig explains most others tells which belong
together; those that keep their order and fit give the longest common row.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle import rms_px
from phone_host.calibration.solve.bundle_problem import Vector, project_view
from phone_host.calibration.solve.calibrate_alone import LEAST_PAIRS, LoneCamera, calibrate_alone, state_of
from phone_host.calibration.target.corners import Board, agree
from phone_host.calibration.target.pairs import BoardPair, FileCorners
from phone_host.model import Side

_MOST_MISSING: Final = 8
_FITS_SHARE: Final = 1 / 400
"""How well a rig from one pair predicts the right views of others, as a share of the image's width: 3 px of 1280. On a
real rig pairs of one moment are off by 0.5 to 1.5 px, those of two moments by 20 px and more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOfStep:
    """Where two folders are out of step.

    Attributes:
        side: on which pictures are missing.
        alone: names of the pictures on the other side that may have no partner, in order.
        missing: how many are missing.
    """

    side: Side
    alone: tuple[str, ...]
    missing: int


def out_of_step(
    left: tuple[FileCorners, ...], right: tuple[FileCorners, ...], board: Board, sizes_px: tuple[tuple[int, int], ...]
) -> OutOfStep | None:
    """Find the pictures without a partner, where they are not the last ones, in both sides in the order in which they were paired.

    Returns:
        What is missing; None if the counts agree, if pairs in order fit as well as any, or if nothing fits.
    """
    missing = len(left) - len(right)
    if missing == 0 or abs(missing) > _MOST_MISSING:
        return None
    side = Side.RIGHT if missing > 0 else Side.LEFT
    try:
        fits = _fits(left, right, board, sizes_px)
    except (DataError, cv2.error):
        return None
    partners = _longest_row(fits)
    if len(partners) < LEAST_PAIRS or len(partners) <= np.trace(fits):
        return None
    longer = left if side is Side.RIGHT else right
    paired = {pair[0 if side is Side.RIGHT else 1] for pair in partners}
    alone = [index for index in range(len(longer)) if index not in paired]
    seen = [index for index in alone if len(longer[index].corners)]
    if len(seen) >= abs(missing):  # where no board was seen says nothing about partners
        alone = seen
    return OutOfStep(side=side, alone=tuple(longer[index].name for index in alone), missing=abs(missing))


def _fits(
    left: tuple[FileCorners, ...], right: tuple[FileCorners, ...], board: Board, sizes_px: tuple[tuple[int, int], ...]
) -> NDArray[np.bool_]:
    """Return (L, R): which pictures show the board in one place, by the rig that explains most of them.

    Raises:
        DataError: one side's pictures give no camera.
    """
    points_m = board.points_m()
    cameras = [
        _camera(files, side, points_m, size)
        for files, side, size in zip((left, right), (Side.LEFT, Side.RIGHT), sizes_px, strict=True)
    ]
    missing = len(left) - len(right)
    shifts = range(min(missing, 0), max(missing, 0) + 1)
    near = [
        (row, row - shift)
        for row in range(len(left))
        for shift in shifts
        if 0 <= row - shift < len(right) and len(left[row].corners) and len(right[row - shift].corners)
    ]
    left_poses = {row: fit_pose(points_m, left[row].corners, cameras[0].parameters) for row in {row for row, _ in near}}
    seen = {pair: agree(left[pair[0]].corners, right[pair[1]].corners, board) for pair in near}
    most_px, best = _FITS_SHARE * sizes_px[1][0], np.zeros((len(left), len(right)), bool)
    for row, column in near:
        right_pose = fit_pose(points_m, seen[row, column], cameras[1].parameters)
        state = state_of(cameras[0].parameters, cameras[1].parameters, left_poses[row], right_pose)
        predicted = {each: project_view(state, pose, points_m)[1] for each, pose in left_poses.items()}
        fits = np.zeros_like(best)
        for pair in near:
            fits[pair] = rms_px(seen[pair] - predicted[pair[0]]) <= most_px
        if fits.sum() > best.sum():
            best = fits
    return best


def _camera(files: tuple[FileCorners, ...], side: Side, points_m: Vector, size_px: tuple[int, int]) -> LoneCamera:
    """Calibrate one side alone, from all pictures with a board.

    Raises:
        DataError: fewer than three are left.
    """
    views = [BoardPair(file.name, file.corners, file.corners) for file in files if len(file.corners)]
    return calibrate_alone(views, side, points_m, size_px)[2]


def _longest_row(fits: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the most partners (left, right) that fit and keep the order of both sides."""
    rows, columns = fits.shape
    length = np.zeros((rows + 1, columns + 1), int)
    for row in range(rows):
        for column in range(columns):
            together = length[row, column] + int(fits[row, column])
            length[row + 1, column + 1] = max(together, length[row, column + 1], length[row + 1, column])
    found, row, column = list[tuple[int, int]](), rows, columns
    while row and column:
        if length[row, column] == length[row - 1, column]:
            row -= 1
        elif length[row, column] == length[row, column - 1]:
            column -= 1
        else:
            row, column = row - 1, column - 1
            found.append((row, column))
    return found[::-1]
