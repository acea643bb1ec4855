"""How a running rig departs from its calibration, as JSON and as a table of a page. Pure."""

import math

from phone_host.diagnostics.drift import is_late, turn_words
from phone_host.model import Change, ChangeKind, Departure, Drift, Turn
from phone_host.output.json_text import json_number
from phone_host.report.report_page import Table

_WORDS = {
    ChangeKind.KNOCKED: "knocked",
    ChangeKind.RETURNED: "a camera or the board was away; measured afresh",
    ChangeKind.CORRECTED: "corrected for",
    ChangeKind.BEYOND: "too far to be corrected",
}


def drift_values(drift: Drift | None) -> dict[str, object] | None:
    """Return the object `drift` of report.json; None without a rig."""
    if drift is None:
        return None
    trend = drift.trend
    return {
        **_standing(drift),
        "focal_sigma_percent": json_number(100 * drift.focal_sigma),
        "overlay": _departure(drift.overlay),
        "zero_sigma_px": json_number(drift.zero_sigma_px),
        "features": drift.features,
        "pairs_used": drift.measurements,
        "pairs_judged": drift.judged,
        "trend": {
            "seconds": json_number(trend.seconds),
            "turn_deg_per_min": _degrees(trend.turn_rad_s, 60.0),
            "turn_sigma_deg_per_min": _degrees(trend.sigma_rad_s, 60.0),
            "vertical_error_px_per_min": json_number(60 * trend.rows_px_s),
        },
        "late_left_ms": json_number(drift.late_ns / 1e6),
        "late_sigma_ms": json_number(drift.late_sigma_ns / 1e6),
        "is_late": is_late(drift),
        "changes": [_change(change) for change in drift.changes],
    }


def stills_drift_values(drift: Drift | None) -> dict[str, object] | None:
    """Return the object `drift` of `stereo`'s report.json for several pairs; None without a rig.

    Args:
        drift: of the pairs, with their numbers, from 1 on, for seconds.
    """
    if drift is None:
        return None
    trend = drift.trend
    return {
        **_standing(drift),
        "pairs_judged": drift.judged,
        "trend": {
            "turn_deg_per_pair": _degrees(trend.turn_rad_s),
            "turn_sigma_deg_per_pair": _degrees(trend.sigma_rad_s),
            "vertical_error_px_per_pair": json_number(trend.rows_px_s),
        },
        "knocked_at_pair": [round(change.at_s) for change in drift.changes if change.kind is ChangeKind.KNOCKED],
    }


def _standing(drift: Drift) -> dict[str, object]:
    """What is said of the rig in every report: how it stands, and what that does to its rows."""
    return {
        "state": drift.state.value,
        "departure": _departure(drift.departure),
        "turn_sigma_deg": _degrees(drift.turn_sigma_rad),
        "vertical_error_px": json_number(drift.rows_px),
        "vertical_error_sigma_px": json_number(drift.rows_sigma_px),
        "vertical_error_left_px": json_number(drift.left_px),
    }


def drift_table(drift: Drift | None) -> tuple[Table, ...]:
    """Make a table of what happened to the rig; none if nothing did.

    Args:
        drift: of the run; None without a rig.
    """
    if drift is None or not drift.changes:
        return ()
    rows = tuple(
        (f"{change.at_s:.1f} s", _WORDS[change.kind], turn_words(change.departure) or "none")
        for change in drift.changes
    )
    return (Table("The rig while it ran", ("when", "what", "right camera against its calibration"), rows),)


def _change(change: Change) -> dict[str, object]:
    values: dict[str, object] = {
        "what": change.kind.value,
        "at_s": round(change.at_s, 3),
        "departure": _departure(change.departure),
    }
    if change.kind is ChangeKind.KNOCKED:
        values["step"] = _departure(change.step)
    if change.kind is ChangeKind.RETURNED:
        values["away_s"] = round(change.away_s, 3)
    return values


def _departure(departure: Departure) -> dict[str, object]:
    return {
        "turn_deg": _degrees(departure.turn_rad),
        "focal_percent": json_number(100 * (departure.focal - 1)),
    }


def _degrees(turn: Turn, times: float = 1.0) -> list[float | None]:
    """Pitch, yaw and roll: about the right camera's x, y and z axis."""
    return [json_number(math.degrees(angle) * times) for angle in turn]
