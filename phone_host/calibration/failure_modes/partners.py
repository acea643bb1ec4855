"""Finds out which left picture belongs to which right one, where pairs do not fit each other. Pure.

Any two pictures may be partners, so every left one is tried with every right one: the rig that follows predicts all right
views from the left ones. The rig that finds most left views somewhere on the right is the true one; where it finds them
elsewhere than in their pair, the pair is wrong.
"""

import math
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.failure_modes.lone import lone_camera
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.target.corners import Board, agree
from phone_host.calibration.target.pairs import BoardPair
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
