"""Tells a board that is not flat: a solved rig sees it bent the same way in all views. Pure.

Noise bends each view otherwise, and so does what contradicts a stiff rig; paper that is not glued down stays as it is. The rig was
calibrated with that bend (`bent_board`): what is told is what a flat board would spare.
"""

from typing import Final

import numpy as np

from phone_host.calibration.failure_modes.mistakes import Finding, Mistake
from phone_host.calibration.solve.bent_board import BENT_SIGMAS, common_bows_m
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.target.corners import Board

_BENT: Final = 0.004
"""Share of the board's side: 0.8 mm of 200 mm. Boards of four real rigs, whose results are good, stay at 0.003 and below."""


def bent(found: Calibration, board: Board) -> Finding | None:
    """Name a board that is bent in all views alike.

    Args:
        found: the calibration.
        board: the board.
    """
    bows, sigmas = common_bows_m([used.in_space for used in found.used])
    sides = np.array([board.columns - 1, board.rows - 1]) * board.square_m
    shares = np.where(np.abs(bows) > BENT_SIGMAS * sigmas, np.abs(bows) / sides, 0.0)
    axis = int(shares.argmax())
    if not shares[axis] > _BENT:
        return None
    along = ("rows", "columns")[axis]
    bow = f"{abs(bows[axis]) * 1e3:.2f} +- {sigmas[axis] * 1e3:.2f} mm over {sides[axis] * 1e3:.0f} mm"
    return Finding(
        mistake=Mistake.BENT,
        sentence=f"the board is not flat: along its {along} it is bent by {bow}",
        remedy="glue it to glass or another flat plate, and take all views again",
    )
