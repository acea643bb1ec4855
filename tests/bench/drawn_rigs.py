"""Rigs that are off as a calibration says of itself: drawn from the covariance of one."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle import adjust, free_flags
from phone_host.calibration.solve.bundle_problem import Bend, BundleState, moved
from phone_host.geometry.lens import standard_errors
from phone_host.geometry.se3 import rotations_of, vectors_of
from phone_host.model import Rig
from tests.support.boards import BOARD, exact_pairs, poses

Floats = NDArray[np.float64]

_BOARDS: Final = 15
_CORNERS_PX: Final = 0.15
"""Standard deviation of a corner's coordinate: that of a webcam."""


def with_covariance(rig: Rig, seed: int) -> Rig:
    """Return a true rig with the covariance that a calibration with 15 boards has there."""
    board_poses = poses(_BOARDS, seed)
    pairs = exact_pairs(rig, board_poses, _CORNERS_PX, seed)
    views = pairs
    free = free_flags(Bend.USUAL.free(), Bend.USUAL.free())
    return replace(rig, covariance=adjust(views, BOARD.points_m(), _state(rig, board_poses), free).covariance)


def drawn_rig(rig: Rig, random: np.random.Generator) -> Rig:
    """Return a rig that is off by chance, as its covariance says; it states the same covariance."""
    step = standard_errors(rig.covariance) @ random.normal(size=len(rig.covariance))
    found = moved(_state(rig, np.zeros((0, 6))), step, np.zeros((0, 6)))
    return replace(
        rig,
        left=found.left,
        right=found.right,
        R_right_left=rotations_of(found.rotation),
        t_right_left_m=found.translation_m,
    )


def _state(rig: Rig, board_poses: Floats) -> BundleState:
    return BundleState(
        left=rig.left,
        right=rig.right,
        rotation=vectors_of(rig.R_right_left),
        translation_m=rig.t_right_left_m,
        poses=board_poses,
    )
