"""Gives the right corners of all views the place that they would have if the right camera had stood as it does last. Pure.

A turn about the camera's centre moves each ray alike, at any depth. So it is undone in the corners, without knowing the
board: pixel -> ray -> turned ray -> pixel. Calibrated from these corners, the rig is that of the last view.
"""

import cv2
import numpy as np

from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.causes.lone import camera_arrays
from phone_host.calibration.causes.mistakes import Turned


def unturned(pairs: list[BoardPair], turned: Turned) -> list[BoardPair]:
    """Undo the right camera's turns.

    Args:
        pairs: the corners, in the order in which they were taken.
        turned: how it turned. A pair that was not looked at stands as the one before it.

    Returns:
        The pairs as the rig of the last view would see them.
    """
    by_name = dict(zip(turned.names, turned.turns_rad, strict=True))
    matrix, distortion = camera_arrays(turned.lens)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-10)
    last, turn = np.asarray(cv2.Rodrigues(turned.turns_rad[-1])[0]), turned.turns_rad[0]
    result = []
    for pair in pairs:
        turn = by_name.get(pair.name, turn)
        rays = cv2.undistortPointsIter(
            pair.right_px.reshape(-1, 1, 2), matrix, distortion, np.eye(3), np.eye(3), criteria
        )
        points = np.column_stack([np.asarray(rays).reshape(-1, 2), np.ones(len(pair.right_px))])
        back = last @ np.asarray(cv2.Rodrigues(turn)[0]).T
        seen = cv2.projectPoints(points @ back.T, np.zeros(3), np.zeros(3), matrix, distortion)[0]
        result.append(BoardPair(pair.name, pair.left_px, np.asarray(seen, np.float64).reshape(-1, 2)))
    return result
