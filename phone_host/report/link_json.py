"""What report.json of a run says of links, sessions and clocks. Pure; times in ms, null where nothing was measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from phone_host.accounts.delays import Spread
from phone_host.accounts.link_account import LinkTally, SessionAccount, rung_values
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.report.json_result import FieldOf, Number, json_values, made
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.quarantine import Suspects

_MS: Final = 1e6

_spread, _estimate = FieldOf[Spread](), FieldOf[ClockEstimate]()
_tally, _session = FieldOf[LinkTally](), FieldOf[SessionAccount]()

Told = Mapping[str, str | int | float | Mapping[str, str | int | float | None] | None]
"""What a camera tells of itself, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpreadMs:
    """The distribution of a time."""

    count: int
    p50: Number = _spread(lambda spread: spread.p50_ns / _MS)
    p95: Number = _spread(lambda spread: spread.p95_ns / _MS)
    p99: Number = _spread(lambda spread: spread.p99_ns / _MS)
    max: Number = _spread(lambda spread: spread.max_ns / _MS)
    mean: Number = _spread(lambda spread: spread.mean_ns / _MS)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnknownClock:
    """The board's clock before it is known."""

    known: bool = False
    doubts: int
    steps: int
    suspects: tuple[Suspects, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownClock:
    """The board's clock against the host's."""

    doubts: int
    steps: int
    suspects: tuple[Suspects, ...]
    known: bool = True
    offset_ns: int
    skew_ppm: float = _estimate(lambda estimate: estimate.skew * 1e6)
    uncertainty_us: float = _estimate(lambda estimate: estimate.uncertainty_ns / 1e3)
    bound_us: float = _estimate(lambda estimate: estimate.bound_ns / 1e3)
    round_trip_us: float = _estimate(lambda estimate: estimate.round_trip_ns / 1e3)
    uncertainty_at_pairs_us: Mapping[str, float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stale:
    """Frames that came again, or from an earlier session."""

    duplicate: int
    old_session: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionResult:
    """A session of the board, and what became of its frames."""

    session: str
    grabbed: int
    sent: int
    dropped: Mapping[str, int]
    waiting: int
    received: int
    lost: int
    lost_late: int = _session(lambda account: account.late)
    camera: Told
    stale: Stale = _session(lambda account: made(Stale, account))
    disbelieved: Mapping[str, int] = _session(
        lambda account: {reason.value: count for reason, count in account.disbelieved.items()}
    )
    ended: bool
    tail: str = _session(lambda account: "unknown" if account.vanished else "known")


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkResult:
    """A link."""

    link: str = _tally(lambda tally: tally.name)
    up: bool = _tally(lambda tally: tally.is_up)
    frames: int
    bytes: int
    took_over: int = _tally(lambda tally: tally.carried)
    lost: int
    age_ms: SpreadMs | None


def clock_result(run: RunSnapshot) -> UnknownClock | KnownClock:
    """Return what is known of the board's clock."""
    doubts, steps, suspects = run.link.clock_doubts, run.link.clock_steps, tuple(run.link.suspects)
    if run.estimate is None:
        return UnknownClock(doubts=doubts, steps=steps, suspects=suspects)
    at_pairs = json_values(made(SpreadMs, run.delays.spread("uncertainty")))
    told: KnownClock = made(
        KnownClock,
        run.estimate,
        doubts=doubts,
        steps=steps,
        suspects=suspects,
        uncertainty_at_pairs_us={k: None if v is None else v * 1e3 for k, v in at_pairs.items() if k != "count"},
    )
    return told


def session_result(account: SessionAccount) -> SessionResult:
    """Return what became of a session's frames."""
    before = dict(account.first.dropped)
    dropped = {reason.value: count - before.get(reason, 0) for reason, count in account.latest.dropped}
    # Frames overtake accounts, and the board's last one may not have come: what is here was sent.
    sent = max(account.latest.sent - account.first.sent, account.received + account.lost)
    # A frame that waited when this host came was grabbed before and sent, or dropped, since. It belongs to this account.
    grabbed = account.latest.grabbed - account.first.sent - sum(before.values())
    grabbed = max(grabbed, sent + sum(dropped.values()))
    told: SessionResult = made(
        SessionResult,
        account,
        grabbed=grabbed,
        sent=sent,
        dropped=dropped,
        waiting=grabbed - sent - sum(dropped.values()),
        camera=rung_values(account.rung),
    )
    return told
