"""Tells a board that is not flat: a solved rig sees it bent the same way in all views. Pure.

Noise bends each view otherwise, and so does what contradicts a stiff rig; paper that is not glued down stays as it is.
"""

from typing import Final

import numpy as np

from phone_host.calibration.board_pairs import Calibration
from phone_host.calibration.causes.lone import Vector
from phone_host.calibration.causes.mistakes import Finding, Mistake
from phone_host.calibration.target import Board

_BENT: Final = 0.005
"""Share of the board's side: 1 mm of 200 mm, of which a lens that gives way may hide a third. Boards of four real rigs stay below 0.003."""

_SIGMAS: Final = 5.0
_LEAST_VIEWS: Final = 6


def bent(found: Calibration, board: Board) -> Finding | None:
    """Name a board that is bent in all views alike.

    Args:
        found: the calibration.
        board: the board.
    """
    bows, sigmas = common_bows_m(found)
    sides = np.array([board.columns - 1, board.rows - 1]) * board.square_m
    shares = np.where(np.abs(bows) > _SIGMAS * sigmas, np.abs(bows) / sides, 0.0)
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


def common_bows_m(found: Calibration) -> tuple[Vector, Vector]:
    """Return how far the board's middle stands out in all views together, (2,) m, and the standard deviations by the views' scatter; NaN: too few views."""
    boards = [used.in_space for used in found.used if np.isfinite(used.in_space.bows_m).all()]
    if len(boards) < _LEAST_VIEWS:
        return np.full(2, np.nan), np.full(2, np.nan)
    bows, sigmas = (np.array([getattr(each, name) for each in boards]) for name in ("bows_m", "bow_sigmas_m"))
    weights = sigmas**-2.0
    mean = (weights * bows).sum(axis=0) / weights.sum(axis=0)
    scatter = (weights * (bows - mean) ** 2).sum(axis=0) / (len(boards) - 1)
    return mean, np.sqrt(np.maximum(scatter, 1.0) / weights.sum(axis=0))
