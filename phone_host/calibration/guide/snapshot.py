"""Everything that presenters show of a live calibration, as copied values. Pure."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

from common.versions import REPORT_FORMAT
from phone_host.calibration.guide.coverage import Coverage, Depth, Tilt
from phone_host.calibration.guide.gates import Gate
from phone_host.calibration.guide.wants import ORDER, Want
from phone_host.model import Side


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
