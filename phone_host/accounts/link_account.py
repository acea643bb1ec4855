"""The host's counts of a board and its links, and when the board was away. Only the receiver's thread writes them; others read copies. Pure.

While the board is away nothing can be paired. That time tells nothing of the link, so it counts neither as starvation
nor against the rate of pairs.
"""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, assert_never

from common.protocol.message import BoardCounts, Rung
from common.protocol.session import StaleReason
from common.words import times
from phone_host.accounts.delays import Series
from phone_host.sync.quarantine import Disbelief, Suspects

_MOST_TOLD = 5


@dataclass(frozen=True, slots=True)
class Absence:
    """One absence of the board.

    Attributes:
        gone_ns: when its goodbye came or its silence was noticed, CLOCK_MONOTONIC, ns.
        back_ns: when it sent frames again; None: it has not come back.
    """

    gone_ns: int
    back_ns: int | None = None

    def overlaps(self, since_ns: int, until_ns: int) -> bool:
        """Whether the board was away at some time between the two."""
        return self.gone_ns < until_ns and (self.back_ns is None or self.back_ns > since_ns)


@dataclass(frozen=True, slots=True)
class Away:
    """One absence as it is told.

    Attributes:
        at_s: when it began, counted from the start of the run, s.
        seconds: how long it lasted, or has lasted so far, s.
        is_over: whether the board came back.
    """

    at_s: float
    seconds: float
    is_over: bool


def away_of(absences: Sequence[Absence], started_ns: int, now_ns: int) -> tuple[Away, ...]:
    """Return absences as they are told.

    Args:
        absences: in order.
        started_ns: start of the run, CLOCK_MONOTONIC, ns.
        now_ns: now or the end of the run, ns.
    """
    return tuple(
        Away(
            (absence.gone_ns - started_ns) / 1e9,
            ((now_ns if absence.back_ns is None else absence.back_ns) - absence.gone_ns) / 1e9,
            absence.back_ns is not None,
        )
        for absence in absences
    )


def away_words(away: Sequence[Away]) -> str:
    """Say how often, when and how long the board was away; empty if it was always there."""
    if not away:
        return ""
    each = [f"for {item.seconds:.1f} s from {item.at_s:.0f} s on" for item in away[:_MOST_TOLD]]
    more = f" and {times(len(away) - _MOST_TOLD)} more" if len(away) > _MOST_TOLD else ""
    often = times(len(away))
    back = "and came back" if away[-1].is_over else "and has not come back"
    return f"the board went away {often} {back} ({', '.join(each)}{more}); rates leave this time out"


_MOST_SUSPECTS: Final = 64
"""Number of steps whose suspect frames are remembered. All steps are counted."""

_MOST_ABSENCES: Final = 64
"""Number of absences that are remembered. All are counted."""


@dataclass(slots=True)
class SessionAccount:
    """One board session as the host saw it. Accounts of closed sessions are kept for the report.

    Attributes:
        session: the board's session id.
        first: the board's account when this host was accepted.
        latest: the board's newest account.
        received: frames that came.
        lost: frames that were sent but never came (gaps).
        duplicate: frames that a transport delivered again; dropped.
        late: how many of the lost frames came after all, behind a newer one over another link; dropped.
        old_session: frames of an earlier session; dropped.
        rung: the rung that the board's camera is on.
        disbelieved: frames that came but were not believed, by reason.
        ended: whether the board said that no more frames follow.
        vanished: whether the board left without a goodbye. Then what it sent after `latest` is unknown.
    """

    session: str
    first: BoardCounts
    latest: BoardCounts
    received: int = 0
    lost: int = 0
    duplicate: int = 0
    late: int = 0
    old_session: int = 0
    rung: Rung = field(default_factory=Rung)
    disbelieved: Counter[Disbelief] = field(default_factory=Counter)
    ended: bool = False
    vanished: bool = False

    def copy(self) -> "SessionAccount":
        """Return a copy of the present state."""
        return replace(self, disbelieved=Counter(dict(self.disbelieved)))

    def count_stale(self, reason: StaleReason) -> None:
        """Count a frame that must not be used."""
        match reason:
            case StaleReason.OLD_SESSION:
                self.old_session += 1
            case StaleReason.DUPLICATE:
                self.duplicate += 1
            case StaleReason.LATE:
                self.late += 1
            case StaleReason.BEYOND_CREDIT:
                self.disbelieved[Disbelief.CREDIT] += 1
            case _:
                assert_never(reason)


@dataclass(slots=True)
class LinkTally:
    """The counts of one link.

    Attributes:
        name: its name in delays.jsonl: its kind, with a number if there are several of that kind.
        frames: frames that came over it.
        bytes: bytes of their images.
        carried: how often it became the carrier.
        lost: how often it was lost, or got stuck, after it had been up.
        is_up: whether the board answers there now.
        age: age of the frames on arrival, ns.
    """

    name: str
    frames: int = 0
    bytes: int = 0
    carried: int = 0
    lost: int = 0
    is_up: bool = False
    age: Series = field(default_factory=Series)

    def copy(self) -> "LinkTally":
        """Return a copy of the present state."""
        return replace(self, age=self.age.copy())


@dataclass(slots=True)
class LinkAccount:
    """What the receiver has seen so far. Only its thread writes; others read copies.

    Attributes:
        sessions: the board's sessions.
        links: the links in the order of the command line.
        connects: how often the board was found.
        switches: how often the stream switched from one link to another.
        garbage: packets that were not ours.
        no_clock: frames that came before the clock was known.
        clock_doubts: how often the knowledge of the clocks was contradicted or void.
        clock_steps: how often one of the clocks had stepped.
        suspects: frames that were believed between a step and the echo that revealed it, newest last.
        absences: when the board was away after it had been there, the newest last. Replaced, never changed.
        left: how often the board went away.
    """

    sessions: list[SessionAccount] = field(default_factory=list)
    links: tuple[LinkTally, ...] = ()
    connects: int = 0
    switches: int = 0
    garbage: int = 0
    no_clock: int = 0
    clock_doubts: int = 0
    clock_steps: int = 0
    suspects: deque[Suspects] = field(default_factory=lambda: deque(maxlen=_MOST_SUSPECTS))
    absences: tuple[Absence, ...] = ()
    left: int = 0

    @property
    def current(self) -> SessionAccount:
        """The newest session's account; one without a name before the first session."""
        if not self.sessions:
            self.sessions.append(SessionAccount("", BoardCounts(), BoardCounts()))
        return self.sessions[-1]

    def board_left(self, now_ns: int) -> None:
        """Take note that the board has gone although it had not shown its last image."""
        self.left += 1
        self.absences = (*self.absences[1 - _MOST_ABSENCES :], Absence(now_ns))

    def board_came(self, now_ns: int) -> None:
        """Take note that the board sends frames, for the first time or again."""
        if self.absences and self.absences[-1].back_ns is None:
            self.absences = (*self.absences[:-1], Absence(self.absences[-1].gone_ns, now_ns))

    def was_away(self, since_ns: int, until_ns: int) -> bool:
        """Whether the board was away at some time between the two, ns. Safe from any thread."""
        return any(absence.overlaps(since_ns, until_ns) for absence in reversed(self.absences))

    def copy(self) -> "LinkAccount":
        """Return a copy of the present state. Safe while the receiver's thread writes."""
        return replace(
            self,
            sessions=[account.copy() for account in tuple(self.sessions)],
            links=tuple(tally.copy() for tally in self.links),
            suspects=deque(tuple(self.suspects), maxlen=_MOST_SUSPECTS),
        )

    @property
    def disbelieved(self) -> Counter[Disbelief]:
        """Frames that came but were not believed, over all sessions, by reason."""
        total: Counter[Disbelief] = Counter()
        for account in tuple(self.sessions):
            total.update(account.disbelieved)
        return total


def link_names(kinds: Sequence[str]) -> list[str]:
    """Give each link a unique name.

    Args:
        kinds: the links' kinds, in order.

    Returns:
        The kind for the first link of a kind, `kind-2` for the second and so on.
    """
    seen: Counter[str] = Counter()
    names = []
    for kind in kinds:
        seen[kind] += 1
        names.append(kind if seen[kind] == 1 else f"{kind}-{seen[kind]}")
    return names


def rung_values(rung: Rung) -> dict[str, object]:
    """Return a rung as a JSON object; None for what cannot be set."""
    return {
        "rung": rung.index,
        "lowest_rung": rung.last,
        "changes": rung.changes,
        "fps": round(1e9 / rung.period_ns, 3) if rung.period_ns else None,
        "quality": rung.quality or None,
        "size": f"{rung.width_px}x{rung.height_px}" if rung.width_px else None,
    }


def rung_lines(link: LinkAccount) -> list[str]:
    """Return the latest session's rung as one line for people; empty if the board never changed the rung."""
    if not link.sessions or not link.sessions[-1].rung.changes:
        return []
    rung = link.sessions[-1].rung
    quality = f", quality {rung.quality}" if rung.quality else ""
    size = f", {rung.width_px}x{rung.height_px}" if rung.width_px else ""
    where = f"on rung {rung.index} of {rung.last}" if rung.index else "as it was asked for"
    how = f"{1e9 / rung.period_ns:.3g} frames/s{quality}{size}"
    return [f"board camera: {where} ({how}), changed {times(rung.changes)} by what the link carries"]
