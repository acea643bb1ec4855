"""Says in words when time makes depth wrong: frames of a pair apart, clocks or stamps uncertain, results old, while the image moves. Pure.

Also when what arrived was not believed: then clocks had stepped, or a board, a driver or a stranger says what cannot be.

A point that moves v px a second stands t * v px elsewhere in a frame that is t s late, and a matcher takes that for disparity: beyond half a pixel
depth is wrong by more than a good matcher's own error.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.camera.base import CameraHealth
from phone_host.model import TimeOffset

MOST_ERROR_PX: Final = 0.5
"""DESIGN's limit of time skew x image motion; the matchers' own median error on real images lies at a third of it."""

_MOST_LAG: Final = 0.05
"""A result that lies this share of the image's width behind the scene no longer shows where things are."""

_LEAST_LATENCY_NS: Final = 50_000_000
"""What a phone takes from exposure to the first byte at least while nobody has measured it (decision 0016)."""


class Doubt(Enum):
    """Why depth or its place is not to be trusted."""

    TIME_SKEW = "time_skew"
    CLOCK = "clock"
    STAMPS = "stamps"
    AGE = "age"
    CLOCK_STEPPED = "clock_stepped"
    DISBELIEVED = "disbelieved"
    SPOILED_IMAGES = "spoiled_images"


@dataclass(frozen=True, slots=True)
class StampDoubt:
    """How far the two cameras' stamps may differ for one and the same moment.

    Attributes:
        half_width_ns: so far; 0: they cannot.
        why: half a sentence with the figure.
        remedy: what helps.
    """

    half_width_ns: int
    why: str
    remedy: str


NO_DOUBT: Final = StampDoubt(0, "", "")
"""Of cameras whose stamps say by definition when their images were exposed."""


def stamp_doubt(offset: TimeOffset, own: CameraHealth) -> StampDoubt:
    """Say how well the two cameras' stamps are known to agree.

    Args:
        offset: between them, as it is taken out; the default one was never measured.
        own: of the own camera; its stamps may be arrivals, less a latency.

    Returns:
        What is left. A latency's uncertainty counts only where the time offset was not measured: the measurement took the latency along.
    """
    late_ns = own.jitter_ns or 0
    late = "" if own.jitter_ns is None else f", and the own images arrive up to {late_ns / 1e6:.1f} ms late"
    if offset != TimeOffset():
        why = f"the cameras' stamps are known to agree to +-{offset.uncertainty_ns / 1e6:.1f} ms only{late}"
        remedy = "a longer phone-host calibrate-time"
        return StampDoubt(offset.uncertainty_ns + late_ns, why, remedy if not late else f"{remedy}; a steadier network")
    unmeasured = f"nobody has measured by how much the cameras' stamps differ, +-{offset.uncertainty_ns / 1e6:.1f} ms"
    if own.jitter_ns is None:
        return StampDoubt(offset.uncertainty_ns, unmeasured, "phone-host calibrate-time")
    remedy = "phone-host calibrate-time, or latency_ms= and latency_uncertainty_ms= in the own camera's address"
    if own.latency_ns is None:
        why = f"{unmeasured}, nor the own camera's latency, some {_LEAST_LATENCY_NS / 1e6:.0f} ms or more{late}"
        return StampDoubt(offset.uncertainty_ns + _LEAST_LATENCY_NS + late_ns, why, remedy)
    stated_ns = own.latency_uncertainty_ns
    if stated_ns is None:
        return StampDoubt(offset.uncertainty_ns + late_ns, f"{unmeasured}, nor how exact latency_ms is{late}", remedy)
    why = f"{unmeasured}, the own camera's latency is known to +-{stated_ns / 1e6:.1f} ms{late}"
    return StampDoubt(offset.uncertainty_ns + stated_ns + late_ns, why, "phone-host calibrate-time")


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """What time and motion are, over the last pairs or a run; NaN = not measured.

    Attributes:
        time_skew_ns: what 95 % of the pairs stay below.
        uncertainty_ns: of the clocks' offset.
        end_to_end_ns: median age of a result.
        motion_px_s: speed of the fastest tenth of the image, px/s.
        width_px: of the image.
        stamps: how well the two cameras' stamps agree.
    """

    time_skew_ns: float
    uncertainty_ns: float
    end_to_end_ns: float
    motion_px_s: float
    width_px: int
    stamps: StampDoubt = NO_DOUBT


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Unbelieved:
    """What was not believed of what arrived.

    Attributes:
        clock_steps: how often a clock was found to have stepped.
        suspect_frames: frames that had passed between a step and the echo that told of it.
        disbelieved: frames that came and were dropped, by reason.
        received: frames that came.
        spoiled_images: images of either camera that were not what their headers said, by what was wrong.
    """

    clock_steps: int
    suspect_frames: int
    disbelieved: dict[str, int]
    received: int
    spoiled_images: dict[str, int]


_OF_THE_CLOCK: Final = frozenset({"clock_in_doubt", "proven_by_no_echo"})
_STOOD_STILL: Final = "none of them was used; if it goes on, see what stops one of the two programs or machines"
_LIES: Final = (
    "none of them was used; if it goes on, update the board's software and check its camera and who else uses the link"
)


def unbelieved_concerns(unbelieved: Unbelieved) -> tuple[Concern, ...]:
    """Say what was not believed, and what that means; nothing where all was."""
    found = []
    if unbelieved.clock_steps:
        suspect = (
            f"; up to {unbelieved.suspect_frames} pairs before that was noticed are suspect"
            if unbelieved.suspect_frames
            else ""
        )
        found.append(
            Concern(
                Doubt.CLOCK_STEPPED,
                f"one of the two clocks stepped {unbelieved.clock_steps} times{suspect}",
                "do not let the board or the host sleep during a run; leave the suspect pairs out (report.json names them)",
            )
        )
    if unbelieved.spoiled_images:
        found.append(
            Concern(
                Doubt.SPOILED_IMAGES,
                f"{sum(unbelieved.spoiled_images.values())} images were spoiled and not used ({_reasons(unbelieved.spoiled_images)})",
                "check the cable, the camera and its format; one now and then does no harm",
            )
        )
    if unbelieved.disbelieved:
        reasons = _reasons(unbelieved.disbelieved)
        found.append(
            Concern(
                Doubt.DISBELIEVED,
                f"{sum(unbelieved.disbelieved.values())} frames of {unbelieved.received} were not believed and dropped ({reasons})",
                _STOOD_STILL if _OF_THE_CLOCK.issuperset(unbelieved.disbelieved) else _LIES,
            )
        )
    return tuple(found)


def _reasons(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in counts.items())


def timing_concerns(timing: Timing) -> tuple[Concern, ...]:
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
    stamps_px = timing.stamps.half_width_ns / 1e9 * motion
    if stamps_px > MOST_ERROR_PX:
        sentence = f"{timing.stamps.why}, while {moves}: {stamps_px:.1f} px may be wrong"
        found.append(Concern(Doubt.STAMPS, sentence, timing.stamps.remedy))
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
