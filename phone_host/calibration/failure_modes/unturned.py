"""Gives the right corners of all views the place that they would have if the right camera had stood as it does last. Pure.

A turn about the camera's centre moves each ray alike, at any depth. So it is undone in the corners, without knowing the
board: pixel -> ray -> turned ray -> pixel. Calibrated from these corners, the rig is that of the last view.
"""

import cv2
import numpy as np

from phone_host.calibration.failure_modes.mistakes import Turned
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import project, rays_through


def unturned(pairs: list[BoardPair], turned: Turned) -> list[BoardPair]:
    """Undo the right camera's turns.

    Args:
        pairs: the corners, in the order in which they were taken.
        turned: how it turned. A pair that was not looked at stands as the one before it.

    Returns:
        The pairs as the rig of the last view would see them.
    """
    by_name = dict(zip(turned.names, turned.turns_rad, strict=True))
    last, turn = np.asarray(cv2.Rodrigues(turned.turns_rad[-1])[0]), turned.turns_rad[0]
    result = []
    for pair in pairs:
        turn = by_name.get(pair.name, turn)
        back = last @ np.asarray(cv2.Rodrigues(turn)[0]).T
        seen = project(rays_through(pair.right_px, turned.lens) @ back.T, turned.lens)
        result.append(BoardPair(pair.name, pair.left_px, seen))
    return result
