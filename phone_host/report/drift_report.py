"""How a running rig departs from its calibration, as JSON and as a table of a page. Pure."""

import math
from dataclasses import dataclass

from phone_host.diagnostics.drift import is_late, turn_words
from phone_host.model import Change, ChangeKind, Departure, Drift, DriftState, Trend, Turn
from phone_host.report.json_result import ABSENT, D3, Absent, FieldOf, Number, made
from phone_host.report.report_page import Table

_WORDS = {
    ChangeKind.KNOCKED: "knocked",
    ChangeKind.RETURNED: "a camera or the board was away; measured afresh",
    ChangeKind.CORRECTED: "corrected for",
    ChangeKind.BEYOND: "too far to be corrected",
}

_departure, _change, _trend, _drift = FieldOf[Departure](), FieldOf[Change](), FieldOf[Trend](), FieldOf[Drift]()

Degrees = tuple[Number, ...]
"""Pitch, yaw and roll: about the right camera's x, y and z axis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepartureResult:
    """How the right camera departs from its calibration."""

    turn_deg: Degrees = _departure(lambda departure: _degrees(departure.turn_rad))
    focal_percent: Number = _departure(lambda departure: 100 * (departure.focal - 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How a rig stands, and what that does to its rows."""

    state: DriftState
    departure: DepartureResult = _drift(lambda drift: made(DepartureResult, drift.departure))
    turn_sigma_deg: Degrees = _drift(lambda drift: _degrees(drift.turn_sigma_rad))
    vertical_error_px: Number = _drift(lambda drift: drift.rows_px)
    vertical_error_sigma_px: Number = _drift(lambda drift: drift.rows_sigma_px)
    vertical_error_left_px: Number = _drift(lambda drift: drift.left_px)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunTrend:
    """How the departure moves while a run goes on."""

    seconds: Number
    turn_deg_per_min: Degrees = _trend(lambda trend: _degrees(trend.turn_rad_s, 60.0))
    turn_sigma_deg_per_min: Degrees = _trend(lambda trend: _degrees(trend.sigma_rad_s, 60.0))
    vertical_error_px_per_min: Number = _trend(lambda trend: 60 * trend.rows_px_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeResult:
    """What happened to a rig."""

    what: ChangeKind = _change(lambda change: change.kind)
    at_s: D3
    departure: DepartureResult = _change(lambda change: made(DepartureResult, change.departure))
    step: DepartureResult | Absent = _change(
        lambda change: made(DepartureResult, change.step) if change.kind is ChangeKind.KNOCKED else ABSENT
    )
    away_s: D3 | Absent = _change(lambda change: change.away_s if change.kind is ChangeKind.RETURNED else ABSENT)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDrift(Standing):
    """How a running rig departs from its calibration."""

    focal_sigma_percent: Number = _drift(lambda drift: 100 * drift.focal_sigma)
    overlay: DepartureResult = _drift(lambda drift: made(DepartureResult, drift.overlay))
    zero_sigma_px: Number
    features: int
    pairs_used: int = _drift(lambda drift: drift.measurements)
    pairs_judged: int = _drift(lambda drift: drift.judged)
    trend: RunTrend = _drift(lambda drift: made(RunTrend, drift.trend))
    late_left_ms: Number = _drift(lambda drift: drift.late_ns / 1e6)
    late_sigma_ms: Number = _drift(lambda drift: drift.late_sigma_ns / 1e6)
    is_late: bool = _drift(is_late)
    changes: tuple[ChangeResult, ...] = _drift(lambda drift: made(ChangeResult, drift.changes))


@dataclass(frozen=True, slots=True, kw_only=True)
class StillsTrend:
    """How the departure moves from pair to pair."""

    turn_deg_per_pair: Degrees = _trend(lambda trend: _degrees(trend.turn_rad_s))
    turn_sigma_deg_per_pair: Degrees = _trend(lambda trend: _degrees(trend.sigma_rad_s))
    vertical_error_px_per_pair: Number = _trend(lambda trend: trend.rows_px_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class StillsDrift(Standing):
    """The same over pairs of image files; their numbers, from 1 on, stand for seconds."""

    pairs_judged: int = _drift(lambda drift: drift.judged)
    trend: StillsTrend = _drift(lambda drift: made(StillsTrend, drift.trend))
    knocked_at_pair: tuple[int, ...] = _drift(
        lambda drift: tuple(round(each.at_s) for each in drift.changes if each.kind is ChangeKind.KNOCKED)
    )


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


def _degrees(turn: Turn, times: float = 1.0) -> tuple[float, ...]:
    return tuple(math.degrees(angle) * times for angle in turn)
