"""A rig whose right camera has turned or changed its focal length since it was calibrated. Pure.

The left camera, the baseline and so the whole geometry of the rectified pair stay: only the right image is seen through
other maps. Left images, crops, disparities and metres of pairs before and after a correction mean the same.
"""

from dataclasses import replace

import numpy as np

from phone_host.geometry.se3 import rotations_of
from phone_host.model import AS_CALIBRATED, Departure, Rectification, Rig


def corrected_rig(rig: Rig, departure: Departure) -> Rig:
    """Return the rig as it stands now."""
    if departure == AS_CALIBRATED:
        return rig
    turn = rotations_of(np.array(departure.turn_rad))
    matrix = rig.right.matrix.copy()
    matrix[(0, 1), (0, 1)] *= departure.focal
    return replace(
        rig,
        right=replace(rig.right, matrix=matrix),
        R_right_left=turn @ rig.R_right_left,
        t_right_left_m=turn @ rig.t_right_left_m,
    )


def corrected_rectification(made: Rectification, departure: Departure) -> Rectification:
    """Return the rectification of the corrected rig: that of the calibrated one but for the right camera's rotation."""
    if departure == AS_CALIBRATED:
        return made
    return replace(made, R_right=made.R_right @ rotations_of(np.array(departure.turn_rad)).T)
