"""Everything that presenters show of a live calibration: how it grows, as copied values, as lines of text and as one SVG picture. Pure.

Of each camera: the picture as it takes it, not mirrored, with the cells in which corners were seen and the board now; bars of
the views at each distance; the board's far edge at each tilt. Below, the words, the figures and what is still wanted.
In text: the darker a cell, the more corners were seen in it; `++` is the board now.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from html import escape
from typing import Any, Final

from common.versions import REPORT_FORMAT
from common.words import counted
from phone_host.calibration.guide.coverage import COLUMNS, ROWS, Coverage, Depth, Tilt
from phone_host.calibration.guide.gates import Gate
from phone_host.calibration.guide.wants import ORDER, Want, spot_of
from phone_host.calibration.solve.next_view import DEPTH_M, DEPTHS_M, after_one_m
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import Board
from phone_host.model import Side, Verdict

LEAST_STATED: Final = 5
"""Fewer views do not show how much they contradict each other (`bundle`): what a rig of them states is too good, and is not told."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Progress:
    """What some views give.

    Attributes:
        views: how many.
        calibration: the rig; None: there is none, for the reason that `remedy` names.
        verdict: of it.
        remedy: what would mend it; empty: nothing is to be mended.
        is_hopeless: whether no further view mends it: a camera is turned, mirrored or on the wrong side.
        taught: standard uncertainty of depth at 1 m that one more view of each kind would leave, m; NaN: one of the cameras would not see it.
    """

    views: int
    calibration: Calibration | None
    verdict: Verdict
    remedy: str
    is_hopeless: bool = False
    taught: Mapping[Want, float] = field(default_factory=dict)

    @property
    def is_stated(self) -> bool:
        """Whether its figures and verdict may be told; why there is no rig is told at once."""
        return self.calibration is None or len(self.calibration.used) >= LEAST_STATED

    @property
    def depth_error_m(self) -> float:
        """Standard uncertainty of depth at 1 m, m; NaN: not known."""
        if self.calibration is None or not self.calibration.depths:
            return float("nan")
        return self.calibration.depths[DEPTHS_M.index(DEPTH_M)][1]

    def after_m(self, want: Want) -> float:
        """Return the same after one more view, m; NaN: not known."""
        return self.taught.get(want, float("nan"))


def lessons(calibration: Calibration, board: Board) -> dict[Want, float]:
    """Return what each kind of view would leave of the depth error of a calibration; see `Progress.taught`."""
    if calibration.rectification is None:
        return {}
    points_m = board.points_m()
    return {want: after_one_m(calibration.rig, calibration.rectification, points_m, spot_of(want)) for want in ORDER}


class Ended(Enum):
    """Why a live calibration ended, or that it did not."""

    RUNNING = "running"
    GOOD = "good"
    ENOUGH = "enough views"
    HOPELESS = "cameras to be set right"
    STOPPED = "stopped"
    STREAM_ENDED = "stream ended"


Outline = tuple[tuple[float, float], ...]
"""The board's outermost corners, shares of width and height; empty: not seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuideSnapshot:
    """A live calibration, as of now.

    Attributes:
        ended: whether and why it ended.
        words: what was said last; empty: nothing yet.
        gate: what became of the newest pair.
        board: its inner corners, such as "9x6"; empty: not known yet.
        views: how many were taken.
        most_views: at most so many will be.
        seconds: since the first pair.
        coverage: of the left and of the right camera; empty before the first pair.
        outlines: the board in the newest pair, left and right.
        asked: the view that is wanted now.
        wanted: the views that are still wanted, this one among them.
        depth_error_m: standard uncertainty of depth at 1 m that the calibration leaves, m; NaN: not known yet.
        next_error_m: the same after the wanted view, m.
        verdict: so far; empty: none yet.
        remedy: what would mend it; empty: nothing is to be mended.
        refused: how many looks were refused at each gate.
    """

    ended: Ended
    words: str
    gate: Gate
    board: str
    views: int
    most_views: int
    seconds: float
    coverage: tuple[Coverage, ...]
    outlines: tuple[Outline, Outline]
    asked: Want
    wanted: tuple[Want, ...]
    depth_error_m: float
    next_error_m: float
    verdict: str
    remedy: str
    refused: tuple[tuple[Gate, int], ...]

    def as_json(self) -> dict[str, Any]:
        """Return it as the content of guide.json."""
        return {
            "format_version": REPORT_FORMAT,
            "command": "calibrate",
            "state": self.ended.value,
            "words": self.words,
            "gate": self.gate.value,
            "board": self.board or None,
            "views": self.views,
            "most_views": self.most_views,
            "seconds": round(self.seconds, 1),
            "cameras": {
                side.value: {
                    "width": each.size_px[0],
                    "height": each.size_px[1],
                    "cells": [list(row) for row in each.cells],
                    "depths": {depth.name.lower(): n for depth, n in zip(Depth, each.depths, strict=True)},
                    "tilts": {tilt.value: n for tilt, n in zip(Tilt, each.tilts, strict=True)},
                    "board_now": [[round(x, 4), round(y, 4)] for x, y in outline],
                }
                for side, each, outline in zip(Side, self.coverage, self.outlines, strict=False)
            },
            "asked": self.asked.value,
            "wanted": [want.value for want in self.wanted],
            "depth_error_at_1_m_mm": _mm(self.depth_error_m),
            "depth_error_after_next_view_mm": _mm(self.next_error_m),
            "verdict": self.verdict or None,
            "remedy": self.remedy,
            "refused": {gate.value: count for gate, count in self.refused},
        }


def _mm(metres: float) -> float | None:
    return round(metres * 1e3, 3) if math.isfinite(metres) else None


def before_board(words: str, most_views: int, seconds: float) -> GuideSnapshot:
    """Return the snapshot of a live calibration whose board is not known yet."""
    return GuideSnapshot(
        ended=Ended.RUNNING,
        words=words,
        gate=Gate.NOT_FOUND,
        board="",
        views=0,
        most_views=most_views,
        seconds=seconds,
        coverage=(),
        outlines=((), ()),
        asked=Want.ANY,
        wanted=ORDER,
        depth_error_m=math.nan,
        next_error_m=math.nan,
        verdict="",
        remedy="",
        refused=(),
    )


_SHADES: Final = (" ·", "░░", "▒▒", "██")
_PER_SHADE: Final = 12
"""Corners of a cell for one shade more: about one view."""

_NOW: Final = "++"
_WIDTH: Final = 2 * COLUMNS
_ARROWS: Final = {Tilt.LEFT_AWAY: "←", Tilt.RIGHT_AWAY: "→", Tilt.TOP_AWAY: "↑", Tilt.BOTTOM_AWAY: "↓"}

_WIDTH_PX, _PANEL_PX, _GAP_PX, _MARGIN_PX = 720, 332, 24, 16
_HEAD_PX: Final = 64
_BAR_PX: Final = 16
_FULL: Final = 36
"""Corners of a cell for the strongest colour: about three views."""

_STYLE: Final = (
    "text{font:13px system-ui,sans-serif;fill:#333}.words{font-size:24px;font-weight:600;fill:#111}.cell{stroke:#ddd}"
    ".cell,.bar{fill:#0072b2}.now{fill:none;stroke:#d55e00;stroke-width:2.5}.empty{fill:none;stroke:#ccc}"
)


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
        after = (
            f", after the next view {_mm_text(snapshot.next_error_m)}" if math.isfinite(snapshot.next_error_m) else ""
        )
        lines.append(f"depth at 1 m {_mm_text(snapshot.depth_error_m)}{after}")
    lines.append(f"verdict so far: {snapshot.verdict}")
    return tuple(lines)


def _mm_text(metres: float) -> str:
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


def guide_svg(snapshot: GuideSnapshot) -> str:
    """Draw a live calibration."""
    parts = [f'<text class="words" x="{_MARGIN_PX}" y="36">{escape(snapshot.words)}</text>']
    bottom = float(_HEAD_PX)
    for index, (name, coverage, outline) in enumerate(
        zip(("left", "right"), snapshot.coverage, snapshot.outlines, strict=False)
    ):
        drawn, end = _panel(name, coverage, outline, _MARGIN_PX + index * (_PANEL_PX + _GAP_PX))
        parts += drawn
        bottom = max(bottom, end)
    remedy = (f"to mend: {snapshot.remedy}",) if snapshot.remedy else ()
    wanted = ", ".join(want.value for want in snapshot.wanted)
    for line in (*figure_lines(snapshot), *remedy, f"wanted: {wanted}"):
        bottom += 20
        parts.append(f'<text x="{_MARGIN_PX}" y="{bottom:.0f}">{escape(line)}</text>')
    height = bottom + _MARGIN_PX
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH_PX} {height:.0f}" width="{_WIDTH_PX}" height="{height:.0f}">'
    ground = f'<rect width="{_WIDTH_PX}" height="{height:.0f}" fill="#fff"/>'
    return f"{head}<style>{_STYLE}</style>{ground}{''.join(parts)}</svg>\n"


def _panel(name: str, coverage: Coverage, outline: Outline, left: float) -> tuple[list[str], float]:
    """Draw what is known of one camera; return it and where it ends."""
    width_px, height_px = coverage.size_px
    high = _PANEL_PX * height_px / width_px
    parts = [f'<text x="{left}" y="{_HEAD_PX - 6}">{name} picture, {width_px}x{height_px}</text>']
    for row, counts in enumerate(coverage.cells):
        for column, count in enumerate(counts):
            x, y = left + column * _PANEL_PX / COLUMNS, _HEAD_PX + row * high / ROWS
            parts.append(
                f'<rect class="cell" x="{x:.1f}" y="{y:.1f}" width="{_PANEL_PX / COLUMNS:.1f}" height="{high / ROWS:.1f}"'
                f' fill-opacity="{0.85 * min(1.0, count / _FULL):.2f}"/>'
            )
    if outline:
        points = " ".join(f"{left + x * _PANEL_PX:.1f},{_HEAD_PX + y * high:.1f}" for x, y in outline)
        parts.append(f'<polygon class="now" points="{points}"/>')
    top = _HEAD_PX + high + 8
    for depth, count in zip(Depth, coverage.depths, strict=True):
        parts.append(_bar(depth.name.lower(), count, left, top))
        top += _BAR_PX + 4
    for tilt, count in zip(Tilt, coverage.tilts, strict=True):
        parts.append(_bar(tilt.value, count, left, top))
        top += _BAR_PX + 4
    return parts, top


def _bar(name: str, count: int, left: float, top: float) -> str:
    """Draw a name, a bar and its count; an outline where there is nothing yet."""
    at = left + 100
    shape = (
        f'<rect class="bar" x="{at}" y="{top:.1f}" width="{min(count, 12) * 18}" height="{_BAR_PX - 4}"/>'
        if count
        else f'<rect class="empty" x="{at}" y="{top:.1f}" width="18" height="{_BAR_PX - 4}"/>'
    )
    text_at = top + _BAR_PX - 6
    number = f'<text x="{at + max(1, min(count, 12)) * 18 + 6}" y="{text_at:.1f}">{count}</text>'
    return f'<text x="{left}" y="{text_at:.1f}">{escape(name)}</text>{shape}{number}'
