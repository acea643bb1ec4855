"""Says what makes the depth of a run wrong or its figures doubtful: other cameras than the rig's, spoiled images, a camera that went away. Pure.

A rig holds for two cameras as they were: another camera, or the same one mounted otherwise, has another geometry, so
the run is refused. A control that is not as it was (focus and zoom move the image) is a concern. What either side does
not state is not compared: a rig without cameras, a camera without a serial number, images that come from no device.

While the image moves, depth is wrong if the frames of a pair are apart in time, clocks or stamps are uncertain, or results are old. In a frame that is
t s late, a point that moves at v px/s is displaced by t * v px, and a matcher takes that for disparity. Beyond half a pixel, the depth error exceeds a
good matcher's own error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from common.camera.base import CameraHealth, CameraState
from common.camera_identity import CameraIdentity, RememberedCamera
from common.diagnostic import Diagnostic, Severity
from common.errors import DataError
from common.protocol.message import CameraDescription, Locks
from common.words import counted, distance_text, times
from phone_host.diagnostics.arrangement import with_final_options
from phone_host.diagnostics.codes import REJECTED_RIG, Code, diagnose, gravest_first
from phone_host.diagnostics.drift import drift_concerns, told_as_a_turn
from phone_host.diagnostics.image_judge import Episode
from phone_host.diagnostics.image_numbers import blamed, number_concerns, with_cause
from phone_host.diagnostics.run_snapshot import (
    LockMiss,
    RunSnapshot,
    disbelieved,
    spoiled,
    spoiled_on_board,
)
from phone_host.diagnostics.throughput import with_budget
from phone_host.model import (
    CutCounts,
    DepthLimits,
    Side,
    TimeOffset,
)
from phone_host.sync.quarantine import Disbelief

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


def state_of(camera: CameraDescription, held: Locks) -> RememberedCamera:
    """Return what is to be remembered of a camera."""
    locks = tuple((lock.value, value) for lock, value in held)
    return RememberedCamera(camera.identity, camera.width_px, camera.height_px, camera.orientation, locks)


def require_camera(
    side: Side, whose: str, rig: RememberedCamera, present: CameraDescription, other: CameraIdentity
) -> None:
    """Check that a camera is the rig's and is mounted as it was.

    Raises:
        DataError: it is another camera, or has another orientation; names both and what to do.
    """
    if not present.identity.is_known:
        return
    there = f"{whose} is {present.identity}"
    if rig.identity.differs_from(present.identity):
        exchanged = other.is_known and not other.differs_from(present.identity)
        remedy = "exchange the two cameras" if exchanged else "plug that one in"
        raise DataError(
            f"{there}, but the rig's {side.value} camera was {rig.identity}",
            f"{remedy}, calibrate again with these, or remove {side.value}_camera from the rig's file",
        )
    if rig.identity.is_known and rig.orientation != present.orientation:
        now, then = (str(turn) or "neither rotate= nor flip=" for turn in (present.orientation, rig.orientation))
        raise DataError(
            f"{there}, with {now}, but the rig was calibrated with {then}",
            f"mount it and give its address as before, calibrate again, or remove {side.value}_camera from the rig's file",
        )


def misses(side: Side, rig: RememberedCamera, held: Locks) -> tuple[LockMiss, ...]:
    """Return the rig's locks that a camera does not have."""
    now = {lock.value: value for lock, value in held}
    return tuple(
        LockMiss(side=side, control=name, wanted=wanted, present=now.get(name))
        for name, wanted in rig.locks
        if now.get(name) != wanted
    )


def settings_concerns(missed: Sequence[LockMiss]) -> Iterator[Diagnostic]:
    """Say which controls could not be restored; nothing if all were."""
    said = ", ".join(
        f"the {miss.side.value} camera's {miss.control} is "
        f"{'not held' if miss.present is None else miss.present} instead of {miss.wanted}"
        for miss in missed
    )
    if said:
        yield diagnose(
            Code.CAMERA_SETTINGS,
            f"{said}, so depth may be wrong",
            "see which controls the camera has: board-agent cameras; or calibrate again as it is now",
        )


GONE: Final = frozenset({Code.BOARD_GONE, Code.CAMERA_GONE})
"""Doubts about when depth came, not whether it is right."""


def gone_concerns(run: RunSnapshot) -> Iterator[Diagnostic]:
    """Say which camera is away; nothing if both are there, or their streams ended as they should."""
    back = "has not come back" if run.ended == "running" else "did not come back"
    if run.away and not run.away[-1].is_over and run.ended != "stream_ended":
        gone = f"the board went away at {run.away[-1].at_s:.0f} s and {back}"
        yield (
            diagnose(
                Code.BOARD_GONE,
                f"{gone}: there is no newer depth",
                "check its power, its cable or network, and that board-agent still runs there",
            )
            if run.refused is None
            else diagnose(Code.BOARD_GONE, f"{gone}, because {run.refused.message}", run.refused.remedy)
        )
    if run.camera.state is CameraState.GONE:
        yield diagnose(
            Code.CAMERA_GONE,
            f"this machine's camera went away at about {run.last_s:.0f} s and {back}: there is no newer depth",
            "check its power, its cable or network, and that no other program has taken it; a phone's app must stay in front",
        )


_ENOUGH: Final = 10
"""So many spoiled images before the first pair are no single hitch: a third of a second of video."""


def _not_whole(run: RunSnapshot) -> dict[str, int]:
    """Count images that were not whole, by where that was found."""
    return {
        "from the board's camera": spoiled_on_board(run.link)[0],
        "from this machine's camera": run.spoiled,
        "found when pairs were decoded": sum(count for _, count in run.spoiled_images),
    }


def nothing_whole(run: RunSnapshot) -> bool:
    """Tell whether there is no pair because images are spoiled: the run goes on, since a cable may be pushed in again."""
    return not run.processed and sum(_not_whole(run).values()) >= _ENOUGH


_OF_THE_CLOCK: Final = frozenset({"clock_in_doubt", "proven_by_no_echo"})
_STOOD_STILL: Final = "none of them was used; if this goes on, find out what stops one of the two programs or machines"
_LIES: Final = "none of them was used; if this goes on, update the board's software, check its camera, and check who else uses the link"


def arrival_concerns(run: RunSnapshot) -> Iterator[Diagnostic]:
    """Say which arrivals were not believed and what that means; nothing if everything was believed."""
    link, images, frames = run.link, spoiled(run), disbelieved(run)
    if link.clock_steps:
        suspect = sum(suspects.frames for suspects in link.suspects)
        yield diagnose(
            Code.CLOCK_STEPPED,
            f"one of the two clocks jumped {times(link.clock_steps)}; up to {counted(suspect, 'pair')} may be wrong because they came before that was noticed"
            if suspect
            else f"one of the two clocks jumped {times(link.clock_steps)}",
            "do not let the board or the host sleep during a run; ignore the suspect pairs, which report.json names",
        )
    if images:
        yield diagnose(
            Code.SPOILED_IMAGES,
            f"{counted(sum(images.values()), 'spoiled image was', 'spoiled images were')} not used ({_reasons(images)})",
            "check the cable, the camera and its format; one now and then does no harm",
        )
    if frames:
        received = sum(account.received + account.disbelieved[Disbelief.CREDIT] for account in link.sessions)
        dropped, is_of_clock = sum(frames.values()), _OF_THE_CLOCK.issuperset(frames)
        yield diagnose(
            Code.DISBELIEVED,
            f"{dropped} of {counted(received, 'frame')} had impossible values and {'was' if dropped == 1 else 'were'} dropped ({_reasons(frames)})",
            _STOOD_STILL if is_of_clock else _LIES,
            severity=Severity.NOTE if is_of_clock else None,
        )


def _reasons(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in counts.items())


_CUT_SHARE: Final = 0.15
"""If fewer pixels than this share were matched and then cut, the pairs lack depth because their images do not match."""

_CAUSES: Final = frozenset({Code.SEARCH_TOO_SHORT, Code.DARK, Code.UNFOCUSED, Code.NO_TEXTURE})
"""Doubts that explain it."""

_UNMATCHED: Final = diagnose(
    Code.NO_DEPTH,
    "no pair has depth",
    "check that --calibration or --rectified fits the cameras, and that both see the same scene",
)

_AT_ZERO: Final = diagnose(
    Code.NO_DEPTH,
    "no pair has depth: all points are too far to measure",
    "move nearer or mount the cameras farther apart; check that --calibration or --rectified fits the cameras",
)


def no_depth(cut: CutCounts | None, limits: DepthLimits | None, others: tuple[Diagnostic, ...] = ()) -> Diagnostic:
    """Return the doubt about pairs of which no pixel has depth."""
    cause = [concern for concern in others if concern.code in _CAUSES]
    if cause:
        return diagnose(Code.NO_DEPTH, f"{_UNMATCHED.message}: {cause[0].message}", cause[0].remedy)
    return _UNMATCHED if cut is None else _by_cut(cut, limits)


def _by_cut(cut: CutCounts, limits: DepthLimits | None) -> Diagnostic:
    """Say which limit cut the points, if it is that."""
    most = max(cut.at_zero, cut.too_far, cut.too_near)
    if most < _CUT_SHARE * cut.inside or not most:
        return _UNMATCHED
    if most == cut.at_zero or limits is None:
        return _AT_ZERO
    found = cut.at_zero + cut.too_far + cut.too_near
    who = "all points lie" if most == found else "most points lie"
    if most == cut.too_near:
        return diagnose(
            Code.NO_DEPTH,
            f"no pair has depth: {who} nearer than --near {distance_text(limits.near_m)}",
            "give a smaller --near, or move away",
        )
    if limits.from_rig:
        return diagnose(
            Code.NO_DEPTH,
            f"no pair has depth: {who} farther than {distance_text(limits.far_m)}, where these cameras measure too coarsely",
            "move nearer or mount the cameras farther apart; --far shows farther points all the same",
        )
    return diagnose(
        Code.NO_DEPTH,
        f"no pair has depth: {who} farther than --far {distance_text(limits.far_m)}",
        "give a larger --far",
    )


def time_and_motion(run: RunSnapshot) -> Timing:
    """Return time and motion over the pairs to be judged."""
    last = run.judged_pairs
    return Timing(
        time_skew_ns=float("nan") if run.interpolated else run.delays.spread("time_skew", last).p95_ns,
        uncertainty_ns=run.delays.spread("uncertainty", last).p50_ns,
        end_to_end_ns=run.delays.spread("end_to_end", last).p50_ns,
        motion_px_s=run.motion_px_s,
        width_px=run.width_px,
        stamps=NO_DOUBT if run.stamps_exact else stamp_doubt(run.time_offset, run.camera),
    )


def concerns(run: RunSnapshot) -> tuple[Diagnostic, ...]:
    """Return what makes the depth of a run wrong or its figures doubtful, most serious first."""
    numbers, images = with_cause(number_concerns(run.replayed), image_concerns(run), run.replayed)
    moved = () if run.drift is None else drift_concerns(run.drift)
    found = [*((REJECTED_RIG,) if run.rig_rejected else ()), *numbers, *told_as_a_turn(images, moved), *moved]
    if nothing_whole(run):
        where = ", ".join(f"{count} {place}" for place, count in _not_whole(run).items() if count)
        found.append(
            diagnose(
                Code.NO_WHOLE_IMAGE,
                f"no pair so far, because images are not whole ({where})",
                "check the cable, the camera and its format on that side; phone-host doctor and board-agent doctor look at one image",
            )
        )
    found += settings_concerns(run.missed_locks)
    if run.processed:
        found += gone_concerns(run)
    return gravest_first((*found, *arrival_concerns(run), *timing_concerns(time_and_motion(run))))


def history(run: RunSnapshot) -> tuple[Episode, ...]:
    """Return which doubts about the images stood during a run, and when, in order of beginning."""
    numbers = number_concerns(run.replayed)
    return tuple(replace(item, concern=blamed(item.concern, numbers, run.replayed)) for item in run.images.history)


def image_concerns(run: RunSnapshot) -> tuple[Diagnostic, ...]:
    """Return what the images of a run make doubtful, gravest first. While it runs, pairs without depth may yet get some."""
    found = tuple(
        with_budget(with_final_options(concern, run.orientations), run.budget) for concern in run.images.concerns
    )
    lacks_depth = run.images.wants_depth and not run.images.has_depth
    if run.ended == "running" or not lacks_depth or not run.processed:
        return found  # without any pair there is another reason
    if any(concern.is_failure for concern in found):
        return found  # which says why there is none
    return (no_depth(run.depth.cut, run.depth.limits, found), *found)


def depth_is_wrong(run: RunSnapshot) -> bool:
    """Tell whether depth was wanted and cannot be right: a doubt stands that leaves no hope, or no pair has depth."""
    return run.images.wants_depth and (not run.images.has_depth or any(concern.is_failure for concern in concerns(run)))
