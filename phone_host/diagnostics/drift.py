"""Says in words how a running rig departs from its calibration, and what to do about it. Pure."""

import math
from typing import Final

from common.diagnostic import Diagnostic
from common.words import times
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.model import AS_CALIBRATED, ChangeKind, Departure, Drift, DriftState

TOLD_TURN_RAD: Final = math.radians(0.25)
"""A rig that has turned by more is no stiff rig, though its rows are corrected: its vergence is known from the corners alone."""

TOLD_FOCUS: Final = 0.004
"""A webcam that focuses from 1 m to 0.5 m changes its focal length by this."""

TOLD_ROWS_PX: Final = 0.25
"""Less than this a good calibration may leave."""

_LATE_SIGMAS: Final = 4.0

_LEAST_LATE_NS: Final = 2e6

_LATE_PX: Final = 0.3
"""Images are called late if that is proven, more than stamps are off by, and spoils rows."""

_TIGHTEN: Final = "tighten the bar, then calibrate again; with the same lenses: calibrate --from rig.yaml --pose-only"

_STIFFEN: Final = "fix both cameras to one stiff bar, then calibrate again"

_HOLD: Final = "switch autofocus off, hold the focus that you scan with, and calibrate again"

_TIME: Final = "measure the cameras' time offset: phone-host calibrate-time"

_EXPLAINED: Final = frozenset({Code.MIRRORED, Code.TURNED, Code.TURNED_BY_QUARTER, Code.OTHER_SCENE})


def turn_words(departure: Departure) -> str:
    """Name the departure's parts that are not 0: "pitch +0.300 degrees, focal length +1.00 %"."""
    named = zip(("pitch", "yaw", "roll"), departure.turn_rad, strict=True)
    parts = [f"{name} {math.degrees(angle):+.2f} degrees" for name, angle in named if angle]
    if departure.focal != 1:
        parts.append(f"focal length {100 * (departure.focal - 1):+.2f} %")
    return ", ".join(parts)


def drift_concerns(drift: Drift) -> tuple[Diagnostic, ...]:
    """Say what of a rig's departure its user must know."""
    found = []
    if drift.state is DriftState.UNKNOWN and _was_knocked(drift):
        problem = f"the cameras turned against each other{_when(drift)}; by how much is not known, because too few features were seen since"
        found.append(diagnose(Code.RIG_MOVED, problem, _TIGHTEN))
    departure, is_beyond = drift.departure, drift.state is DriftState.BEYOND
    angle = f"{math.degrees(departure.angle_rad):.2f} degrees"
    if is_beyond and not _is_focus(departure):
        found.append(
            diagnose(
                Code.RIG_MOVED,
                f"the cameras have turned against each other since the calibration ({turn_words(departure)}): too far to be corrected, depth is wrong",
                _STIFFEN,
            )
        )
    elif (
        not is_beyond
        and drift.rows_px >= TOLD_ROWS_PX
        and departure.angle_rad
        and (_was_knocked(drift) or _is_far(departure))
    ):
        found.append(
            diagnose(
                Code.RIG_MOVED,
                f"the cameras turned by {angle} against each other{_when(drift)}; {_mended(drift)}",
                _TIGHTEN,
            )
        )
    if _is_focus(departure) or (not is_beyond and abs(departure.focal - 1) >= TOLD_FOCUS):
        found.append(
            diagnose(
                Code.FOCUS_CHANGED,
                f"the cameras' focal lengths changed by {100 * (departure.focal - 1):+.1f} % against each other since the calibration: one has focused anew; {_mended(drift)}",
                _HOLD,
            )
        )
    if is_late(drift):
        found.append(
            diagnose(
                Code.LATE_IMAGES,
                f"moving objects are off their row by {drift.late_px:.1f} px: the {'left' if drift.late_ns > 0 else 'right'} images show it"
                f" {abs(drift.late_ns) / 1e6:.0f} +- {2 * drift.late_sigma_ns / 1e6:.0f} ms later than their stamps say",
                _TIME,
            )
        )
    return tuple(found)


def told_as_a_turn(images: tuple[Diagnostic, ...], moved: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """Return the doubts about images without those that a knocked rig explains.

    Features that agree on one turn of a camera are those of one scene, upright and not mirrored; single pairs of a rig
    that was knocked by some degrees may look so.
    """
    if all(concern.code != Code.RIG_MOVED for concern in moved):
        return images
    return tuple(concern for concern in images if concern.code not in _EXPLAINED)


def is_late(drift: Drift) -> bool:
    """Tell whether the images of one side are proven to be late."""
    proven = abs(drift.late_ns) >= max(_LATE_SIGMAS * drift.late_sigma_ns, _LEAST_LATE_NS)
    return proven and drift.late_px >= _LATE_PX


def drift_lines(drift: Drift | None) -> list[str]:
    """Say how the rig departs from its calibration, and how often it may have been touched; nothing without a rig, or if no pair was judged."""
    if drift is None or not drift.judged:
        return []
    away = [change for change in drift.changes if change.kind is ChangeKind.RETURNED]
    if not away:
        return [_drift_line(drift)]
    often = times(len(away))
    return [
        _drift_line(drift),
        f"a camera or the board was away {often}, last for {away[-1].away_s:.1f} s: drift measurement started again",
    ]


def _drift_line(drift: Drift) -> str:
    if drift.state is DriftState.UNKNOWN:
        used = "nothing was corrected" if drift.overlay == AS_CALIBRATED else "the earlier correction is kept"
        return f"drift: not measured: too few features, or too badly spread; {used}"
    if drift.state is DriftState.STEADY:
        return f"drift: none; the rig matches its calibration, the row error is known to {drift.rows_sigma_px:.2f} px"
    told = {
        DriftState.CORRECTED: "corrected",
        DriftState.DEPARTED: "not corrected",
        DriftState.BEYOND: "too far to be corrected",
    }[drift.state]
    trend = f"; {trended}" if (trended := _trend_words(drift)) else ""
    turned = turn_words(drift.departure) or "as calibrated"
    rows = f"vertical error {drift.rows_px:.2f} px, {drift.left_px:.2f} px left"
    return f"drift: the right camera against its calibration: {turned}; {told}: {rows}{trend}"


def stills_words(drift: Drift) -> str:
    """Say how a rig stood over the order of pairs, with pairs for seconds."""
    if drift.state is DriftState.UNKNOWN:
        return "drift: not measured: too few features, or too badly spread"
    rows = f"the row error is known to {drift.rows_sigma_px:.2f} px"
    told = f"{turn_words(drift.departure)}; vertical error {drift.rows_px:.2f} px, {drift.left_px:.2f} px left; {rows}"
    parts = [
        f"the right camera against its calibration: {told}"
        if drift.departure != AS_CALIBRATED
        else f"none; the rig matches its calibration, {rows}"
    ]
    knocks = [f"{change.at_s:.0f}" for change in drift.changes if change.kind is ChangeKind.KNOCKED]
    if moving := _moving(drift, 1.0):
        parts.append(f"it turns from pair to pair, {moving} degrees")
    elif knocks:
        parts.append(f"it changed at once at pair {', '.join(knocks)}")
    return f"drift: {'; '.join(parts)}"


def stills_remedy(drift: Drift) -> str:
    """Say what to do about the rig of some stills; empty: it stands as it was calibrated, or nothing is known of it."""
    if drift.state is DriftState.UNKNOWN or drift.left_px < TOLD_ROWS_PX:
        return ""
    return _HOLD if _is_focus(drift.departure) else _TIGHTEN


def _trend_words(drift: Drift) -> str:
    """Say how fast it still turns, if that is proven."""
    moving = _moving(drift, 60.0)
    return f"it still turns, {moving} degrees a minute" if moving else ""


def _moving(drift: Drift, times: float) -> str:
    """Name the axes that are proven to turn, with their rates: "pitch by +0.020"; empty: none."""
    axes = zip(("pitch", "yaw", "roll"), drift.trend.turn_rad_s, drift.trend.sigma_rad_s, strict=True)
    return ", ".join(
        f"{name} by {math.degrees(rate) * times:+.3f}" for name, rate, sigma in axes if abs(rate) > _LATE_SIGMAS * sigma
    )


def _was_knocked(drift: Drift) -> bool:
    return any(change.kind is ChangeKind.KNOCKED for change in drift.changes)


def _is_focus(departure: Departure) -> bool:
    """Tell whether it is the focus that has changed: beyond a correction, a turn is read as some of it, too."""
    return abs(departure.focal - 1) >= TOLD_FOCUS and not _is_far(departure)


def _is_far(departure: Departure) -> bool:
    return departure.angle_rad >= TOLD_TURN_RAD


def _when(drift: Drift) -> str:
    knocks = [change for change in drift.changes if change.kind is ChangeKind.KNOCKED]
    if not knocks:
        return " since the calibration"
    return f", at once {knocks[-1].at_s:.0f} s after the start"


def _mended(drift: Drift) -> str:
    """Say what a correction does for depth, and what it can't."""
    if drift.state is DriftState.BEYOND:
        return "too far to be corrected, depth is wrong"
    if drift.state is not DriftState.CORRECTED:
        return f"rows are off by {drift.rows_px:.1f} px, and depth suffers"
    return f"rows are corrected to {max(drift.left_px, 0.05):.1f} px, but disparities may all be off by {2 * drift.zero_sigma_px:.1f} px"
