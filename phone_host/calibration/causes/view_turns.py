"""How the right camera stood in each view, from the loosened rig: what a stiff rig cannot show. Pure.

Each view's right camera may turn about its own centre, and everything else is estimated with it. The uncertainty is that by
the corners' noise; the mean turn is the stiff rig's own and taken as zero.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.causes.lone import apart_px, both_alone
from phone_host.calibration.causes.loosened import DEVIATIONS, MOVE, TURN, Loosened, Stiff, loosen
from phone_host.calibration.target import Board
from phone_host.model.calibration_session import ViewTurns

LEAST_PAIRS: Final = 6
"""With fewer, the lenses explain the turns."""

_MOST_PAIRS: Final = 60
"""The work grows with their square."""


def view_turns(pairs: list[BoardPair], board: Board, sizes_px: tuple[tuple[int, int], ...]) -> ViewTurns | None:
    """Find out how the right camera stood in each view.

    Args:
        pairs: the corners of the pairs that one rig explains, in the order in which they were taken.
        board: the board.
        sizes_px: width and height of the left and of the right images.

    Returns:
        The turns; None if there are too few or too many pairs, or they do not tell.
    """
    if not LEAST_PAIRS <= len(pairs) <= _MOST_PAIRS:
        return None
    points_m = board.points_m()
    try:
        alone = both_alone(pairs, points_m, sizes_px)
        if alone is None or len(alone[0]) < LEAST_PAIRS:
            return None
        kept, left, right = alone
        _, rig = apart_px(kept, left, right, points_m)
        start = Stiff(left=left.lens, right=right.lens, rotation=rig[:3], translation_m=rig[3:], poses=left.poses)
        free = np.array([1, 1, 1, 1, 1, 1, 1, 1, len(kept) >= 2 * LEAST_PAIRS], bool)
        return _turns(kept, loosen(kept, points_m, start, free, sizes_px=sizes_px))
    except (cv2.error, np.linalg.LinAlgError):
        return None


def _turns(kept: list[BoardPair], loose: Loosened) -> ViewTurns:
    """Let each view's right camera turn on its own, at the least squares."""
    count, kinds = loose.count, np.eye(DEVIATIONS)
    alike = np.tile(np.eye(3), (count, 1)) / np.sqrt(count)  # all turned alike are the stiff rig itself
    apart = np.linalg.svd(alike)[0][:, 3:]
    each = np.kron(np.eye(count), kinds[:, TURN]) @ apart
    columns = np.hstack([each, np.kron(np.ones((count, 1)), kinds[:, MOVE])])  # and the baseline may change
    inverse = np.linalg.inv(columns.T @ loose.information @ columns)
    gradient = columns.T @ loose.gradient
    numbers = inverse @ gradient
    left_px2 = max(loose.squares_px2 - float(gradient @ numbers), 0.0)
    noise_px2 = left_px2 / max(1, loose.numbers - 9 * count)
    own = apart.shape[1]
    variances = np.diag(apart @ inverse[:own, :own] @ apart.T) * noise_px2
    return ViewTurns(
        names=tuple(pair.name for pair in kept),
        turns_rad=(apart @ numbers[:own]).reshape(-1, 3),
        sigmas_rad=np.sqrt(variances.clip(min=0)).reshape(-1, 3),
    )
