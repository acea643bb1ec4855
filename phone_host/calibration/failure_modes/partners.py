"""Finds out which left picture belongs to which right one: where pairs do not fit each other, and where two folders without numbers are out of step. Pure.

Both sides are taken in the order of their names. From the first picture that is missing on, each pair shows two moments.
The pair of pictures, up to as many places apart as are missing, whose rig explains most others tells which belong
together; those that keep their order and fit give the longest common row.

Any two pictures may be partners, so every left one is tried with every right one: the rig that follows predicts all right
views from the left ones. The rig that finds most left views somewhere on the right is the true one; where it finds them
elsewhere than in their pair, the pair is wrong.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.failure_modes.lone import lone_camera
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle import rms_px
from phone_host.calibration.solve.bundle_problem import Vector, project_view
from phone_host.calibration.solve.calibrate_alone import LEAST_PAIRS, LoneCamera, calibrate_alone, state_of
from phone_host.calibration.target.corners import Board, agree
from phone_host.calibration.target.pairs import BoardPair, FileCorners
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Side

_FITS_SHARE: Final = 1 / 250
"""How well a rig from one pair predicts the other views' places, as a share of the image's width: 2.5 px of 640."""

_CLEARLY: Final = 3.0
"""By how much better another partner must fit than the present one."""

_TRIED: Final = 12
"""So many left pictures are tried with all right ones: if half of the pictures have a partner, six would do."""

_ENOUGH: Final = 0.9
_PLACED: Final = 0.5
"""A rig that places fewer explains nothing: any two views give one."""


def wrong_partners(
    pairs: list[BoardPair], board: Board, sizes_px: tuple[tuple[int, int], ...]
) -> list[tuple[str, str]]:
    """Find pairs whose left picture belongs to another pair's right one.

    Returns:
        Names of (the left picture's pair, the pair of the right picture that belongs to it); empty if pairs fit or none does.
    """
    points_m = board.points_m()
    try:
        found = [lone_camera(list(pairs), side, points_m, size) for side, size in zip(Side, sizes_px, strict=True)]
    except cv2.error:
        return []
    models = [each[1].parameters for each in found if each is not None]
    if len(models) < len(found):
        return []
    limit_px = _FITS_SHARE * sizes_px[1][0]
    errors = _best_errors(pairs, board, models, limit_px)
    wrong = []
    for index, row in enumerate(errors):
        best = int(row.argmin())
        if best != index and row[best] <= limit_px and row[index] > max(limit_px, _CLEARLY * row[best]):
            wrong.append((pairs[index].name, pairs[best].name))
    return wrong


def _best_errors(pairs: list[BoardPair], board: Board, models: list[CameraModel], limit_px: float) -> Vector:
    """Return (V, V): how far each left picture's prediction is from each right picture, px, by the rig that places most.

    All infinite if no rig places enough of them.
    """
    points_m, count = board.points_m(), len(pairs)
    left = [fit_pose(points_m, pair.left_px, models[0]) for pair in pairs]
    right = np.array([_orders(pair.right_px, board) for pair in pairs])
    right_poses: dict[tuple[int, int], Vector] = {}
    tried = np.unique(np.linspace(0, count - 1, min(_TRIED, count)).astype(int)).tolist()
    # Pairs as they are come first: if most of them fit, nothing else is tried.
    candidates = [(i, i) for i in tried] + [(i, j) for i in tried for j in range(count) if i != j]
    best, most = np.full((count, count), np.inf), (int(_PLACED * count), -math.inf)
    for i, j in candidates:
        order = _same_way(pairs[i].left_px, right[j], board)
        if (j, order) not in right_poses:
            right_poses[j, order] = fit_pose(points_m, right[j, order], models[1])
        rig = SE3.of(right_poses[j, order]) @ SE3.of(left[i]).inverse()
        predicted = np.array([project((rig @ SE3.of(pose)).apply(points_m), models[1]) for pose in left])
        squares = np.nanmean(((predicted[:, np.newaxis, np.newaxis] - right) ** 2).sum(axis=4), axis=3)
        errors = np.sqrt(squares.min(axis=2))
        nearest = errors.min(axis=1)
        placed = nearest <= limit_px
        score = int(placed.sum()), -float(nearest[placed].sum())
        if score > most:
            best, most = errors, score
        if most[0] >= _ENOUGH * count:
            break
    return best


def _orders(corners: Vector, board: Board) -> Vector:
    """Return (T, N, 2): corners in each order in which the board's colours leave them."""
    grid = corners.reshape(board.rows, board.columns, 2)
    return np.array([np.rot90(grid, turn).reshape(-1, 2) for turn in board.quarter_turns])


def _same_way(left: Vector, orders: Vector, board: Board) -> int:
    """Return which of the orders runs like the left view's."""
    chosen = agree(left, orders[0], board)
    return int(np.nansum(np.abs(orders - chosen), axis=(1, 2)).argmin())


_MOST_MISSING: Final = 8
_IN_STEP_SHARE: Final = 1 / 400
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
    most_px, best = _IN_STEP_SHARE * sizes_px[1][0], np.zeros((len(left), len(right)), bool)
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
