"""Views of an earlier calibration, as rig.yaml keeps them, and those of a new one. Pure."""

from dataclasses import replace
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.board_names import board_name, named_board
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.output.rig_views import RigViews

_SAME_PX: Final = 1e-3
"""More than rig.yaml rounds; two pictures never agree so in all corners."""


def pairs_of(views: RigViews) -> list[BoardPair]:
    """Return the pairs that a rig was computed from."""
    return [
        BoardPair(name, left, right)
        for name, left, right in zip(views.names, views.left_px, views.right_px, strict=True)
    ]


def board_of(views: RigViews) -> Board:
    """Return the board that they show.

    Raises:
        DataError: its name contradicts its corners.
    """
    plain = Board(views.columns, views.rows, views.square_m)
    if not views.board:
        return plain
    try:
        board = replace(named_board(views.board, plain.square_m * 1e3), square_m=plain.square_m)
    except SettingsError:
        board = None
    if board is None or replace(board, marks=None) != plain:
        raise DataError(
            f"views.board of the earlier calibration is {views.board!r}", "calibrate from all pictures together"
        )
    return board


def together(earlier: list[BoardPair], later: list[BoardPair]) -> list[BoardPair]:
    """Return earlier and later pairs; a later one whose name is taken gets a number behind it.

    Raises:
        DataError: their boards differ.
    """
    if earlier and later and len(earlier[0].left_px) != len(later[0].left_px):
        raise DataError(
            "the new pictures show another board than the earlier ones",
            "show the same board, or calibrate without --from",
        )
    names = {pair.name for pair in earlier}
    result = list(earlier)
    for pair in later:
        name, number = pair.name, 2
        while name in names:
            name, number = f"{pair.name} ({number})", number + 1
        names.add(name)
        result.append(BoardPair(name, pair.left_px, pair.right_px))
    return result


def new_ones(earlier: list[BoardPair], later: list[BoardPair]) -> list[BoardPair]:
    """Return the later pairs without those whose corners are an earlier pair's: the same pictures, which would count twice."""
    return [pair for pair in later if not any(_is_same(pair, one) for one in earlier)]


def _is_same(pair: BoardPair, other: BoardPair) -> bool:
    return all(
        own.shape == theirs.shape and np.allclose(own, theirs, rtol=0, atol=_SAME_PX, equal_nan=True)
        for own, theirs in ((pair.left_px, other.left_px), (pair.right_px, other.right_px))
    )


def views_of(calibration: Calibration, pairs: list[BoardPair], board: Board) -> RigViews:
    """Return the pairs that a calibration used, for rig.yaml."""
    used = {each.name for each in calibration.used}
    kept = [pair for pair in pairs if pair.name in used]
    return RigViews(
        columns=board.columns,
        rows=board.rows,
        square_m=board.square_m,
        names=tuple(pair.name for pair in kept),
        left_px=np.array([pair.left_px for pair in kept]),
        right_px=np.array([pair.right_px for pair in kept]),
        board=board_name(board),
    )
