"""A live calibration as lines of text, for a terminal of 48 columns or more. Pure.

Beside each other the two pictures as the cameras take them, not mirrored: the darker a cell, the more corners were seen in it;
`++` is the board now. Below each, how many views were far, in the middle and near, and to which side the board's far edge was.
"""

import math
from typing import Final

from common.words import counted
from phone_host.calibration.guide.coverage import COLUMNS, ROWS, Coverage, Tilt
from phone_host.calibration.guide.snapshot import GuideSnapshot, Outline

_SHADES: Final = (" ·", "░░", "▒▒", "██")
_PER_SHADE: Final = 12
"""Corners of a cell for one shade more: about one view."""

_NOW: Final = "++"
_WIDTH: Final = 2 * COLUMNS
_ARROWS: Final = {Tilt.LEFT_AWAY: "←", Tilt.RIGHT_AWAY: "→", Tilt.TOP_AWAY: "↑", Tilt.BOTTOM_AWAY: "↓"}


def picture_lines(snapshot: GuideSnapshot) -> tuple[str, ...]:
    """Return the two pictures, 38 characters wide; none before the board was seen in both."""
    if not snapshot.coverage:
        return ()
    blocks = [
        _block(name, coverage, outline)
        for name, coverage, outline in zip(("left", "right"), snapshot.coverage, snapshot.outlines, strict=True)
    ]
    return tuple("  ".join(row).rstrip() for row in zip(*blocks, strict=True))


def figure_lines(snapshot: GuideSnapshot) -> tuple[str, ...]:
    """Return how far the calibration is: views, depth error, verdict."""
    wanted = f", {counted(len(snapshot.wanted), 'kind')} still wanted" if snapshot.wanted else ""
    board = f"board {snapshot.board}, " if snapshot.board else ""
    return (f"{board}{snapshot.views} of at most {snapshot.most_views} views{wanted}", *verdict_lines(snapshot))


def verdict_lines(snapshot: GuideSnapshot) -> tuple[str, ...]:
    """Return the depth error now and after the next view, and the verdict so far; none before the first calibration."""
    if not snapshot.verdict:
        return ()
    lines = []
    if math.isfinite(snapshot.depth_error_m):
        after = f", after the next view {_mm(snapshot.next_error_m)}" if math.isfinite(snapshot.next_error_m) else ""
        lines.append(f"depth at 1 m {_mm(snapshot.depth_error_m)}{after}")
    lines.append(f"verdict so far: {snapshot.verdict}")
    return tuple(lines)


def _mm(metres: float) -> str:
    return f"+- {metres * 1e3:.1f} mm"


def _block(name: str, coverage: Coverage, outline: Outline) -> list[str]:
    now = _cells_of(outline)
    rows = [
        "".join(_NOW if (column, row) in now else _shade(count) for column, count in enumerate(counts))
        for row, counts in enumerate(coverage.cells)
    ]
    far, middle, near = coverage.depths
    tilts = " ".join(
        f"{_ARROWS[tilt]}{count}" for tilt, count in zip(Tilt, coverage.tilts, strict=True) if tilt in _ARROWS
    )
    lines = [
        f"{name} picture",
        f"┌{'─' * _WIDTH}┐",
        *(f"│{row}│" for row in rows),
        f"└{'─' * _WIDTH}┘",
        f"far{far} mid{middle} near{near}",
        f"tilt {tilts}",
    ]
    return [line.ljust(_WIDTH + 2) for line in lines]


def _shade(count: int) -> str:
    return _SHADES[min(len(_SHADES) - 1, math.ceil(count / _PER_SHADE))]


def _cells_of(outline: Outline) -> set[tuple[int, int]]:
    """Return the cells (column, row) in which the board is."""
    if not outline:
        return set()
    columns = [min(COLUMNS - 1, max(0, int(x * COLUMNS))) for x, _ in outline]
    rows = [min(ROWS - 1, max(0, int(y * ROWS))) for _, y in outline]
    return {
        (column, row) for column in range(min(columns), max(columns) + 1) for row in range(min(rows), max(rows) + 1)
    }
