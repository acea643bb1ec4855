"""Says in words when time makes depth wrong: frames of a pair apart, clocks uncertain, results old, while the image moves. Pure.

A point that moves v px a second stands t * v px elsewhere in a frame that is t s late, and a matcher takes that for disparity: beyond half a pixel
depth is wrong by more than a good matcher's own error.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

MOST_ERROR_PX: Final = 0.5
"""DESIGN's limit of time skew x image motion; the matchers' own median error on real images lies at a third of it."""

_MOST_LAG: Final = 0.05
"""A result that lies this share of the image's width behind the scene no longer shows where things are."""


class Doubt(Enum):
    """Why depth or its place is not to be trusted."""

    TIME_SKEW = "time_skew"
    CLOCK = "clock"
    AGE = "age"


@dataclass(frozen=True, slots=True)
class Timing:
    """What time and motion are, over the last pairs or a run; NaN = not measured.

    Attributes:
        time_skew_ns: what 95 % of the pairs stay below.
        uncertainty_ns: of the clocks' offset.
        end_to_end_ns: median age of a result.
        motion_px_s: speed of the fastest tenth of the image, px/s.
        width_px: of the image.
    """

    time_skew_ns: float
    uncertainty_ns: float
    end_to_end_ns: float
    motion_px_s: float
    width_px: int


@dataclass(frozen=True, slots=True)
class Concern:
    """One reason not to trust the depth.

    Attributes:
        doubt: why.
        sentence: with figures.
        remedy: what helps.
    """

    doubt: Doubt
    sentence: str
    remedy: str


def concerns(timing: Timing) -> tuple[Concern, ...]:
    """Say what makes depth wrong; nothing where it is right or motion is not known."""
    motion = timing.motion_px_s
    if not math.isfinite(motion):
        return ()
    found = []
    moves = f"the image moves {motion:.0f} px/s"
    skew_px = timing.time_skew_ns / 1e9 * motion
    if skew_px > MOST_ERROR_PX:
        found.append(
            Concern(
                Doubt.TIME_SKEW,
                f"frames of a pair are up to {timing.time_skew_ns / 1e6:.1f} ms apart while {moves}: {skew_px:.1f} px of error, depth is wrong",
                "move slower; --align-phase or --interpolate; a smaller --tolerance; higher rates of both cameras",
            )
        )
    clock_px = timing.uncertainty_ns / 1e9 * motion
    if clock_px > MOST_ERROR_PX:
        found.append(
            Concern(
                Doubt.CLOCK,
                f"the board's clock is known to +-{timing.uncertainty_ns / 1e6:.1f} ms only while {moves}: {clock_px:.1f} px may be wrong",
                "wait until the estimate settles; a link with shorter or steadier round trips",
            )
        )
    lag_px = timing.end_to_end_ns / 1e9 * motion
    if lag_px > _MOST_LAG * timing.width_px:
        found.append(
            Concern(
                Doubt.AGE,
                f"results are {timing.end_to_end_ns / 1e6:.0f} ms old while {moves}: the scene has moved {lag_px:.0f} px since",
                "move slower; see the regime for what holds the results up",
            )
        )
    return tuple(found)
