"""Finds out by the boards how one side's images are turned or mirrored against the other's. Pure.

A board's lattice of corners looks the same in a mirror, and a camera that mirrors fits its own views as well as any. Only
together the two sides show it: what the mirrored one sees of a tilted board fits no rigid rig. So the right corners are
also tried mirrored, and in the other orders in which the colours leave them. The order that predicts the right views from
the left ones gives a rig; how that one rolls, and on which side its right camera stands, tells which side to turn.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from common.orientation import Flip, Orientation
from phone_host.calibration.solve.bundle import rig_of
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.solve.calibrate import Sizes, fit_rig
from phone_host.calibration.solve.calibrate_alone import calibrate_alone, prediction_errors_px, states_of, with_poses
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import Board, Corners, agree
from phone_host.calibration.target.pairs import BoardPair, Reason
from phone_host.model import Rig, Side
from phone_host.stereo.rectify import rectify_rig

_ROLLED_DEG: Final = 45.0
"""Nearer to a quarter turn than to none."""

_CLEARLY: Final = 3.0
"""By how much better another order must predict. On a real rig: 0.5 px for the true one, 15 px for mirrored views."""

_CONTRADICTIONS: Final = 0.25
"""Share of pairs that were rejected because left and right do not fit each other, from which on the boards are asked."""

_TURNS: Final = (0, 90, 180, 270)
_QUARTER: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A clockwise quarter turn of the image, in the camera's axes (x right, y down)."""

_MIRROR: Final = np.diag([-1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Misplaced:
    """What is to be done to one side's images.

    Attributes:
        side: whose.
        turn: what makes them agree with the other side's.
        is_either: the same done to the other side gives a rig too; the boards cannot tell which side is wrong.
    """

    side: Side
    turn: Orientation
    is_either: bool = False

    @property
    def is_mirrored(self) -> bool:
        """Whether the images are mirror images."""
        return self.turn.flip is not Flip.NONE


def misplaced(
    pairs: list[BoardPair], board: Board, sizes_px: Sizes, found: Calibration | DataError
) -> Misplaced | None:
    """Find out whether one side's images are turned or mirrored, where the calibration looks like it.

    Returns:
        The side and its turn, with which the same corners give a rig that can be rectified; None if none does.
    """
    if not pairs or not _is_suspect(found):
        return None
    try:
        mirrored, rig = _explaining(pairs, board, sizes_px)
    except (DataError, cv2.error, np.linalg.LinAlgError):  # no order explains enough of the pairs
        return None
    likely = list(_turns(rig, is_mirrored=mirrored))
    first = next((each for each in likely if _works(pairs, board, sizes_px, each[1])), None)
    if first is None:
        return None
    is_beside, wrong = first
    twin = is_beside, Misplaced(side=_other(wrong.side), turn=wrong.turn)
    return replace(wrong, is_either=twin in likely and _works(pairs, board, sizes_px, twin[1]))


def is_contradicted(found: Calibration) -> bool:
    """Return whether left and right views of many pairs do not fit each other."""
    moved = sum(each.reason is Reason.MOVED for each in found.rejected)
    return moved > _CONTRADICTIONS * (moved + len(found.used))


def composed(first: Orientation, then: Orientation) -> Orientation:
    """Return the one orientation that does the same as two, one after the other."""
    if first.flip is Flip.NONE:
        return Orientation((first.rotate_deg + then.rotate_deg) % 360, then.flip)
    # A mirror turns later turns round.
    turn = first.rotate_deg - then.rotate_deg
    if then.flip is Flip.NONE:
        return Orientation(turn % 360, first.flip)
    # Two unlike mirrors are half a turn.
    return Orientation((turn + (0 if first.flip is then.flip else 180)) % 360)


def turned_corners(corners: Corners, size_px: tuple[int, int], turn: Orientation, board: Board) -> Corners:
    """Return where corners lie in the turned image, in an order that is not mirrored.

    Args:
        corners: (N, 2), px, as `order_by_colour` leaves them.
        size_px: width and height of the image.
        turn: of the image; mirrored only left to right.
        board: the board.
    """
    points, (width, height) = corners, size_px
    for _ in range(turn.rotate_deg // 90):
        points = np.column_stack([height - 1 - points[:, 1], points[:, 0]])
        width, height = height, width
    if turn.flip is Flip.NONE:
        return points
    points = np.column_stack([width - 1 - points[:, 0], points[:, 1]])
    grid = points.reshape(board.rows, board.columns, 2)
    # A board of even columns looks the same from left to right, one of odd columns and even rows from top to bottom.
    grid = grid[::-1] if board.columns % 2 == 1 and board.rows % 2 == 0 else grid[:, ::-1]
    return np.ascontiguousarray(grid.reshape(-1, 2))


def _is_suspect(found: Calibration | DataError) -> bool:
    if isinstance(found, DataError) or found.obstacle is not None:
        return True
    return is_contradicted(found) or abs(_roll_deg(found.rig.R_right_left)) > _ROLLED_DEG


def _explaining(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> tuple[bool, Rig]:
    """Return whether the right views must be mirrored, and the rig that the pairs then give.

    Raises:
        DataError: fewer than three pairs are left.
    """
    plain, *others = (
        (_disagreement_px(tried, board, sizes_px), mirrored, tried)
        for mirrored, tried in _orders(pairs, board, sizes_px)
    )
    best = min(others, key=lambda each: each[0], default=plain)
    _, mirrored, tried = best if best[0] * _CLEARLY < plain[0] else plain
    return mirrored, rig_of(fit_rig(tried, board, sizes_px).result.state)


def _orders(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> Iterator[tuple[bool, list[BoardPair]]]:
    """Give the pairs with their right corners in each order in which the board's symmetry leaves them, the present one first."""
    shape = (board.rows, board.columns, 2)
    if board.marks is not None:  # they tell the corners apart, and are not read in a mirror
        yield False, pairs
        return
    for flip in (Flip.NONE, Flip.H):
        turn = Orientation(0, flip)
        right = [turned_corners(pair.right_px, sizes_px[1], turn, board) for pair in pairs]
        for quarter in board.quarter_turns:
            yield (
                flip is Flip.H,
                [
                    BoardPair(pair.name, pair.left_px, np.rot90(seen.reshape(shape), quarter).reshape(-1, 2).copy())
                    for pair, seen in zip(pairs, right, strict=True)
                ],
            )


def _disagreement_px(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> float:
    """Return how well the best pair's rig predicts the right views of the others: the median, px; infinite if no camera fits."""
    points_m, kept = board.points_m(), pairs
    cameras = []
    try:
        for side, size_px in zip(Side, sizes_px, strict=True):
            kept, _, camera = calibrate_alone(kept, side, points_m, size_px)
            cameras.append(camera)
    except (DataError, cv2.error):
        return math.inf
    states = states_of(*(with_poses(camera, kept, points_m) for camera in cameras))
    errors = prediction_errors_px(states, [pair.right_px for pair in kept], points_m)
    return float(np.median(errors, axis=1).min())


def _turns(rig: Rig, *, is_mirrored: bool) -> Iterator[tuple[bool, Misplaced]]:
    """Give the turns of one side after which the right camera stands upright at the right (True), or above or below (False); the likeliest first.

    Args:
        rig: from the left images as they are and the right ones, mirrored if `is_mirrored`.
        is_mirrored: whether one side is mirrored.
    """
    flip, unmirrored = (Flip.H, _MIRROR) if is_mirrored else (Flip.NONE, np.eye(3))
    found = []
    for side in (Side.RIGHT, Side.LEFT):
        for deg in _TURNS:
            turn = unmirrored @ np.linalg.matrix_power(_QUARTER, deg // 90)
            if side is Side.RIGHT:
                to_turned = turn @ unmirrored  # the rig knows the right images mirrored already
                rotation, shift_m = to_turned @ rig.R_right_left, to_turned @ rig.t_right_left_m
            else:
                rotation, shift_m = unmirrored @ rig.R_right_left @ turn.T, unmirrored @ rig.t_right_left_m
            x, y, _ = -rotation.T @ shift_m
            is_beside = x > abs(y)
            is_changed = is_mirrored or deg != 0
            if is_changed and abs(_roll_deg(rotation)) < _ROLLED_DEG and (is_beside or abs(y) > abs(x)):
                found.append((is_beside, Misplaced(side=side, turn=Orientation(deg, flip))))
    yield from sorted(found, key=lambda item: not item[0])


def _other(side: Side) -> Side:
    return Side.LEFT if side is Side.RIGHT else Side.RIGHT


def _works(pairs: list[BoardPair], board: Board, sizes_px: Sizes, tried: Misplaced) -> bool:
    """Calibrate with one side turned and return whether most pairs then give a rig that can be rectified."""
    sizes = [*sizes_px]
    index = 0 if tried.side is Side.LEFT else 1
    sizes[index] = tried.turn.turned_size(sizes[index])
    turned = []
    for pair in pairs:
        sides = [pair.left_px, pair.right_px]
        sides[index] = turned_corners(sides[index], sizes_px[index], tried.turn, board)
        turned.append(BoardPair(pair.name, sides[0], agree(sides[0], sides[1], board)))
    try:
        found = fit_rig(turned, board, (sizes[0], sizes[1]))
        rectify_rig(rig_of(found.result.state))
    except DataError:
        return False
    return 2 * len(found.kept) > len(pairs)


def _roll_deg(rotation: Vector) -> float:
    """Return by how much a rotation turns the image about the camera's axis, clockwise."""
    return math.degrees(math.atan2(rotation[1, 0], rotation[0, 0]))
