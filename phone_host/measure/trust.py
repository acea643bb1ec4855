"""Says in words when timing makes depth wrong. Pure.

While the image moves, depth is wrong if the frames of a pair are apart in time, clocks or stamps are uncertain, or
results are old. There is also a concern if frames were not believed: then clocks had stepped, or a board, a driver or a
stranger sent something impossible.

In a frame that is t s late, a point that moves at v px/s is displaced by t * v px, and a matcher takes that for
disparity. Beyond half a pixel, the depth error exceeds a good matcher's own error.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.camera.base import CameraHealth
from common.words import counted, times
from phone_host.model import Arrangement, TimeOffset

MOST_ERROR_PX: Final = 0.5
"""DESIGN's limit of time skew x image motion. The matchers' own median error on real images is a third of it."""

_MOST_LAG: Final = 0.05
"""If the scene has moved by this share of the image's width since, a result no longer shows where things are."""

_LEAST_LATENCY_NS: Final = 50_000_000
"""Assumed least latency of a phone camera, exposure to first byte, until it is measured (decision 0016)."""


class Doubt(Enum):
    """Why not to trust the depth or where it is."""

    TIME_SKEW = "time_skew"
    CLOCK = "clock"
    STAMPS = "stamps"
    AGE = "age"
    CLOCK_STEPPED = "clock_stepped"
    DISBELIEVED = "disbelieved"
    SPOILED_IMAGES = "spoiled_images"
    CAMERA_SETTINGS = "camera_settings"
    IMAGE_NUMBERS = "image_numbers"
    IMAGES_APART = "images_apart"
    REJECTED_RIG = "rejected_rig"
    CROPPED_RIG = "cropped_rig"
    GEOMETRY = "geometry"
    RIG_MOVED = "rig_moved"
    FOCUS_CHANGED = "focus_changed"
    LATE_IMAGES = "late_images"
    BOARD_GONE = "board_gone"
    CAMERA_GONE = "camera_gone"
    NO_WHOLE_IMAGE = "no_whole_image"
    SWAPPED = "swapped"
    TURNED = "turned"
    TURNED_BY_QUARTER = "turned_by_quarter"
    MIRRORED = "mirrored"
    SAME_IMAGE = "same_image"
    OTHER_SCENE = "other_scene"
    COVERED = "covered"
    DARK = "dark"
    UNFOCUSED = "unfocused"
    NO_TEXTURE = "no_texture"
    LOW_DENSITY = "low_density"
    LOW_CONSISTENCY = "low_consistency"
    VERTICAL_ERROR = "vertical_error"
    SEARCH_TOO_SHORT = "search_too_short"
    AMBIGUOUS = "ambiguous"
    NO_DEPTH = "no_depth"

    @property
    def blocks(self) -> bool:
        """Whether the depth cannot be right as long as this doubt stands: a run that ends with it fails."""
        return self in _BLOCKING


_BLOCKING: Final = frozenset(
    {
        Doubt.SWAPPED,
        Doubt.TURNED,
        Doubt.TURNED_BY_QUARTER,
        Doubt.MIRRORED,
        Doubt.SAME_IMAGE,
        Doubt.OTHER_SCENE,
        Doubt.COVERED,
        Doubt.IMAGES_APART,
        Doubt.NO_DEPTH,
        Doubt.NO_WHOLE_IMAGE,
    }
)


@dataclass(frozen=True, slots=True)
class StampDoubt:
    """How far the two cameras' stamps may differ for the same moment.

    Attributes:
        half_width_ns: greatest difference; 0: none.
        why: part of a sentence, with the figure.
        remedy: what helps.
    """

    half_width_ns: int
    why: str
    remedy: str


NO_DOUBT: Final = StampDoubt(0, "", "")
"""For cameras whose stamps are the times of exposure by definition."""


def stamp_doubt(offset: TimeOffset, own: CameraHealth) -> StampDoubt:
    """Determine how well the two cameras' stamps are known to agree.

    Args:
        offset: the time offset, as applied. The default one was never measured.
        own: health of the host camera. Its stamps may be arrival times minus a latency.

    Returns:
        The remaining doubt. The latency's uncertainty counts only if the time offset was not measured, because that
        measurement includes the latency.
    """
    late_ns = own.jitter_ns or 0
    late = "" if own.jitter_ns is None else f", and this machine's images arrive up to {late_ns / 1e6:.1f} ms late"
    if offset != TimeOffset():
        why = f"the time offset between the two cameras is only known to +-{offset.uncertainty_ns / 1e6:.1f} ms{late}"
        remedy = "measure longer: phone-host calibrate-time --seconds 60"
        return StampDoubt(
            offset.uncertainty_ns + late_ns, why, remedy if not late else f"{remedy}; use a steadier network"
        )
    unmeasured = f"the time offset between the two cameras was never measured, +-{offset.uncertainty_ns / 1e6:.1f} ms"
    if own.jitter_ns is None:
        return StampDoubt(offset.uncertainty_ns, unmeasured, "measure it with phone-host calibrate-time")
    remedy = "measure it with phone-host calibrate-time, or give latency_ms= and latency_uncertainty_ms= in the camera's address"
    if own.latency_ns is None:
        why = f"{unmeasured}, nor was the latency of this machine's camera, some {_LEAST_LATENCY_NS / 1e6:.0f} ms or more{late}"
        return StampDoubt(offset.uncertainty_ns + _LEAST_LATENCY_NS + late_ns, why, remedy)
    stated_ns = own.latency_uncertainty_ns
    if stated_ns is None:
        return StampDoubt(
            offset.uncertainty_ns + late_ns, f"{unmeasured}, nor is it known how exact latency_ms is{late}", remedy
        )
    why = f"{unmeasured}, the latency of this machine's camera is known to +-{stated_ns / 1e6:.1f} ms{late}"
    return StampDoubt(offset.uncertainty_ns + stated_ns + late_ns, why, "measure it with phone-host calibrate-time")


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Time and motion over the last pairs or a run; NaN = not measured.

    Attributes:
        time_skew_ns: 95th percentile of the pairs' absolute time skews.
        uncertainty_ns: median uncertainty of the clocks' offset.
        end_to_end_ns: median age of a result.
        motion_px_s: speed of the fastest tenth of the image, px/s.
        width_px: width of the image.
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
        doubt: the kind of reason.
        sentence: the reason in words, with figures.
        remedy: what helps.
        is_severe: whether the figures leave no hope, though the kind of reason alone would.
        arrangement: how the images lie to each other, if that is the reason.
        quarters: by how many quarters the right image is turned clockwise against the left one; 0: not known.
        spares_depth: whether it does not say that depth is wrong: results are old, or images were not used.
    """

    doubt: Doubt
    sentence: str
    remedy: str
    is_severe: bool = False
    arrangement: Arrangement | None = None
    quarters: int = 0
    spares_depth: bool = False

    @property
    def is_certain(self) -> bool:
        """Whether depth cannot be right."""
        return self.doubt.blocks or self.is_severe


def gravest_first(found: tuple[Concern, ...]) -> tuple[Concern, ...]:
    """Sort concerns: blocking ones first, then the others that are certain, else in their order."""
    return tuple(sorted(found, key=lambda concern: (not concern.doubt.blocks, not concern.is_certain)))


REJECTED_RIG: Final = Concern(
    Doubt.REJECTED_RIG,
    "the calibration itself was rejected: it does not fit its own images (verdict reject)",
    "calibrate again; its report says what was wrong with the images",
)
"""For a rig that is used because the user insists."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unbelieved:
    """The arrivals that were not believed.

    Attributes:
        clock_steps: how often a clock was found to have stepped.
        suspect_frames: frames that passed between a step and the echo that revealed it.
        disbelieved: frames that came but were dropped, by reason.
        received: frames that came.
        spoiled_images: images of either camera that were not what their headers said, by what was wrong.
    """

    clock_steps: int
    suspect_frames: int
    disbelieved: dict[str, int]
    received: int
    spoiled_images: dict[str, int]


_OF_THE_CLOCK: Final = frozenset({"clock_in_doubt", "proven_by_no_echo"})
_STOOD_STILL: Final = "none of them was used; if this goes on, find out what stops one of the two programs or machines"
_LIES: Final = "none of them was used; if this goes on, update the board's software, check its camera, and check who else uses the link"


def unbelieved_concerns(unbelieved: Unbelieved) -> tuple[Concern, ...]:
    """Say what was not believed and what that means; empty if everything was believed."""
    found = []
    if unbelieved.clock_steps:
        suspect = (
            f"; up to {counted(unbelieved.suspect_frames, 'pair')} may be wrong because they came before that was noticed"
            if unbelieved.suspect_frames
            else ""
        )
        found.append(
            Concern(
                Doubt.CLOCK_STEPPED,
                f"one of the two clocks jumped {times(unbelieved.clock_steps)}{suspect}",
                "do not let the board or the host sleep during a run; ignore the suspect pairs, which report.json names",
            )
        )
    if unbelieved.spoiled_images:
        found.append(
            Concern(
                Doubt.SPOILED_IMAGES,
                f"{counted(sum(unbelieved.spoiled_images.values()), 'spoiled image was', 'spoiled images were')} not used ({_reasons(unbelieved.spoiled_images)})",
                "check the cable, the camera and its format; one now and then does no harm",
                spares_depth=True,
            )
        )
    if unbelieved.disbelieved:
        reasons, is_of_clock = _reasons(unbelieved.disbelieved), _OF_THE_CLOCK.issuperset(unbelieved.disbelieved)
        found.append(
            Concern(
                Doubt.DISBELIEVED,
                f"{sum(unbelieved.disbelieved.values())} of {counted(unbelieved.received, 'frame')} had impossible values and {'was' if sum(unbelieved.disbelieved.values()) == 1 else 'were'} dropped ({reasons})",
                _STOOD_STILL if is_of_clock else _LIES,
                spares_depth=is_of_clock,
            )
        )
    return tuple(found)


def _reasons(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in counts.items())


def timing_concerns(timing: Timing) -> tuple[Concern, ...]:
    """Say what makes depth wrong; empty if it is right or the motion is unknown."""
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
                "move slower; use --align-phase or --interpolate; give a smaller --tolerance; raise the rate of both cameras",
            )
        )
    clock_px = timing.uncertainty_ns / 1e9 * motion
    if clock_px > MOST_ERROR_PX:
        found.append(
            Concern(
                Doubt.CLOCK,
                f"the board's clock is only known to +-{timing.uncertainty_ns / 1e6:.1f} ms while {moves}: {clock_px:.1f} px may be wrong",
                "wait some seconds; use a link with shorter or steadier round trips",
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
                "move more slowly, or shorten the largest delay",
                spares_depth=True,
            )
        )
    return tuple(found)
