"""Says in words when timing makes depth wrong. Pure.

While the image moves, depth is wrong if the frames of a pair are apart in time, clocks or stamps are uncertain, or
results are old.

In a frame that is t s late, a point that moves at v px/s is displaced by t * v px, and a matcher takes that for
disparity. Beyond half a pixel, the depth error exceeds a good matcher's own error.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from common.camera.base import CameraHealth
from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.model import TimeOffset

MOST_ERROR_PX: Final = 0.5
"""DESIGN's limit of time skew x image motion. The matchers' own median error on real images is a third of it."""

_MOST_LAG: Final = 0.05
"""If the scene has moved by this share of the image's width since, a result no longer shows where things are."""

_LEAST_LATENCY_NS: Final = 50_000_000
"""Assumed least latency of a phone camera, exposure to first byte, until it is measured (decision 0016)."""


NO_DOUBT: Final = Diagnostic("", severity=Severity.OK, code=Code.STAMPS, evidence=0)
"""For cameras whose stamps are the times of exposure by definition."""


def _stamp_doubt(half_width_ns: int, message: str, remedy: str) -> Diagnostic:
    return diagnose(Code.STAMPS, message, remedy, evidence=half_width_ns)


def stamp_doubt(offset: TimeOffset, own: CameraHealth) -> Diagnostic:
    """Determine how well the two cameras' stamps are known to agree.

    Args:
        offset: the time offset, as applied. The default one was never measured.
        own: health of the host camera. Its stamps may be arrival times minus a latency.

    Returns:
        The remaining doubt; its evidence is how far the stamps may differ for the same moment, ns. The latency's uncertainty counts only if the time offset was not measured, because that
        measurement includes the latency.
    """
    late_ns = own.jitter_ns or 0
    late = "" if own.jitter_ns is None else f", and this machine's images arrive up to {late_ns / 1e6:.1f} ms late"
    if offset != TimeOffset():
        why = f"the time offset between the two cameras is only known to +-{offset.uncertainty_ns / 1e6:.1f} ms{late}"
        remedy = "measure longer: phone-host calibrate-time --seconds 60"
        return _stamp_doubt(
            offset.uncertainty_ns + late_ns, why, remedy if not late else f"{remedy}; use a steadier network"
        )
    unmeasured = f"the time offset between the two cameras was never measured, +-{offset.uncertainty_ns / 1e6:.1f} ms"
    if own.jitter_ns is None:
        return _stamp_doubt(offset.uncertainty_ns, unmeasured, "measure it with phone-host calibrate-time")
    remedy = "measure it with phone-host calibrate-time, or give latency_ms= and latency_uncertainty_ms= in the camera's address"
    if own.latency_ns is None:
        why = f"{unmeasured}, nor was the latency of this machine's camera, some {_LEAST_LATENCY_NS / 1e6:.0f} ms or more{late}"
        return _stamp_doubt(offset.uncertainty_ns + _LEAST_LATENCY_NS + late_ns, why, remedy)
    stated_ns = own.latency_uncertainty_ns
    if stated_ns is None:
        return _stamp_doubt(
            offset.uncertainty_ns + late_ns, f"{unmeasured}, nor is it known how exact latency_ms is{late}", remedy
        )
    why = f"{unmeasured}, the latency of this machine's camera is known to +-{stated_ns / 1e6:.1f} ms{late}"
    return _stamp_doubt(offset.uncertainty_ns + stated_ns + late_ns, why, "measure it with phone-host calibrate-time")


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
    stamps: Diagnostic = NO_DOUBT


def timing_concerns(timing: Timing) -> Iterator[Diagnostic]:
    """Say what makes depth wrong; nothing if it is right or the motion is unknown."""
    motion, stamps = timing.motion_px_s, timing.stamps
    moves = f"the image moves {motion:.0f} px/s"
    skew_px, clock_px, stamps_px, lag_px = (
        each_ns / 1e9 * motion
        for each_ns in (timing.time_skew_ns, timing.uncertainty_ns, stamps.evidence, timing.end_to_end_ns)
    )  # NaN, an unknown motion, is greater than nothing
    if skew_px > MOST_ERROR_PX:
        yield diagnose(
            Code.TIME_SKEW,
            f"frames of a pair are up to {timing.time_skew_ns / 1e6:.1f} ms apart while {moves}: {skew_px:.1f} px of error, depth is wrong",
            "move slower; use --align-phase or --interpolate; give a smaller --tolerance; raise the rate of both cameras",
        )
    if clock_px > MOST_ERROR_PX:
        yield diagnose(
            Code.CLOCK,
            f"the board's clock is only known to +-{timing.uncertainty_ns / 1e6:.1f} ms while {moves}: {clock_px:.1f} px may be wrong",
            "wait some seconds; use a link with shorter or steadier round trips",
        )
    if stamps_px > MOST_ERROR_PX:
        yield replace(stamps, message=f"{stamps.message}, while {moves}: {stamps_px:.1f} px may be wrong")
    if lag_px > _MOST_LAG * timing.width_px:
        yield diagnose(
            Code.AGE,
            f"results are {timing.end_to_end_ns / 1e6:.0f} ms old while {moves}: the scene has moved {lag_px:.0f} px since",
            "move more slowly, or shorten the largest delay",
        )
