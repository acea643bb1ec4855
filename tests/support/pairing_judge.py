"""Finds the best pairing of two streams offline by dynamic programming, to judge the pairing that must decide at once."""

from dataclasses import dataclass
from typing import Final

_PAIR: Final = 1 << 62
"""A pair is worth more than any possible time skew, so that one integer orders both."""


@dataclass(frozen=True, slots=True, order=True)
class Score:
    """A pairing's score: most pairs first, then least total time skew; greater is better."""

    pairs: int
    minus_skew_ns: int


def best_score(board_ns: list[int], host_ns: list[int], tolerance_ns: int) -> Score:
    """The best score of any ordered one-to-one pairing within the tolerance."""
    value = _table(board_ns, host_ns, tolerance_ns)[-1][-1]
    pairs = -(-value // _PAIR)
    return Score(pairs, value - pairs * _PAIR)


def forbidden_pairs(
    pairs: list[tuple[int, int]], board_ns: list[int], host_ns: list[int], tolerance_ns: int
) -> list[tuple[int, int]]:
    """The given pairs that no best pairing contains."""
    before = _table(board_ns, host_ns, tolerance_ns)
    behind = _table([-b for b in reversed(board_ns)], [-h for h in reversed(host_ns)], tolerance_ns)
    board_at = {stamp: index for index, stamp in enumerate(board_ns)}
    host_at = {stamp: index for index, stamp in enumerate(host_ns)}
    forbidden = []
    for board, host in pairs:
        i, j = board_at[board], host_at[host]
        rest = before[i][j] + behind[len(board_ns) - i - 1][len(host_ns) - j - 1]
        if abs(board - host) > tolerance_ns or rest + _PAIR - abs(board - host) < before[-1][-1]:
            forbidden.append((board, host))
    return forbidden


def _table(board_ns: list[int], host_ns: list[int], tolerance_ns: int) -> list[list[int]]:
    """Best values of all pairs of prefixes."""
    rows = [[0] * (len(host_ns) + 1)]
    for board in board_ns:
        above = rows[-1]
        row = [0]
        left = 0
        for j, host in enumerate(host_ns):
            value = above[j + 1]
            left = max(left, value)
            skew = abs(board - host)
            if skew <= tolerance_ns:
                left = max(left, above[j] + _PAIR - skew)
            row.append(left)
        rows.append(row)
    return rows
