"""What the host saw of a board and its links, in figures. Written by the receiver's thread only; others read copies."""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, assert_never

from common.protocol.message import BoardCounts, Rung
from common.protocol.session import StaleReason
from phone_host.measure.delays import Series
from phone_host.sync.quarantine import Disbelief, Suspects

_MOST_SUSPECTS: Final = 64
"""Steps whose frames are remembered by number; all are counted."""


@dataclass(slots=True)
class SessionAccount:
    """One life of a board as the host saw it; closed accounts are kept for the report.

    Attributes:
        session: the board's session id.
        first: the board's account when this host was accepted.
        latest: the board's newest account.
        received: frames that came.
        lost: frames that were sent and never came (gaps).
        duplicate: frames that a transport delivered again, dropped.
        late: how many of the lost came after all, behind a newer one over another link, and were dropped.
        old_session: frames of an older life of the board, dropped.
        rung: how far the board has lowered what its camera gives.
        disbelieved: frames that came and were not believed, by reason.
        ended: whether the board said that no frame follows.
        vanished: whether the board went without a word: what it sent after `latest` is unknown.
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
        """The same, as it is now."""
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
    """What one link did.

    Attributes:
        name: as it stands in delays.jsonl: its kind, with a number where there are more of that kind.
        frames: that came over it.
        bytes: of their images.
        carried: how often the stream came to it.
        lost: how often it was lost, or stuck, after it had been up.
        is_up: whether the board answers there now.
        age: how old the frames were when they came, ns.
    """

    name: str
    frames: int = 0
    bytes: int = 0
    carried: int = 0
    lost: int = 0
    is_up: bool = False
    age: Series = field(default_factory=Series)

    def copy(self) -> "LinkTally":
        """The same, as it is now."""
        return replace(self, age=self.age.copy())


@dataclass(slots=True)
class LinkAccount:
    """What the receiver has seen so far; written by its thread only; others read copies.

    Attributes:
        sessions: lives of the board.
        links: in the order of the command line.
        connects: how often the board was found.
        switches: how often the stream went from one link to another.
        garbage: packets that were none of ours.
        no_clock: frames that came before the clock was known.
        clock_doubts: how often what was known of the clocks was contradicted, or void.
        clock_steps: how often one of the clocks had stepped.
        suspects: frames that were believed between a step and the echo that told of it, newest last.
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

    def copy(self) -> "LinkAccount":
        """The same, as it is now; may be called while the receiver's thread writes."""
        return replace(
            self,
            sessions=[account.copy() for account in tuple(self.sessions)],
            links=tuple(tally.copy() for tally in self.links),
            suspects=deque(tuple(self.suspects), maxlen=_MOST_SUSPECTS),
        )

    @property
    def disbelieved(self) -> Counter[Disbelief]:
        """Frames that came and were not believed, over all sessions, by reason."""
        total: Counter[Disbelief] = Counter()
        for account in tuple(self.sessions):
            total.update(account.disbelieved)
        return total


def link_names(kinds: Sequence[str]) -> list[str]:
    """Name links so that each name is there once.

    Args:
        kinds: of the links, in order.

    Returns:
        The kind for the first of each, `kind-2` for the second and so on.
    """
    seen: Counter[str] = Counter()
    names = []
    for kind in kinds:
        seen[kind] += 1
        names.append(kind if seen[kind] == 1 else f"{kind}-{seen[kind]}")
    return names


def rung_values(rung: Rung) -> dict[str, object]:
    """How far the board has lowered what its camera gives, as a JSON object; None for what cannot be set."""
    return {
        "rung": rung.index,
        "lowest_rung": rung.last,
        "changes": rung.changes,
        "fps": round(1e9 / rung.period_ns, 3) if rung.period_ns else None,
        "quality": rung.quality or None,
        "size": f"{rung.width_px}x{rung.height_px}" if rung.width_px else None,
    }


def rung_lines(link: LinkAccount) -> list[str]:
    """The same in one line for people; nothing where the board never lowered anything."""
    if not link.sessions or not link.sessions[-1].rung.changes:
        return []
    rung = link.sessions[-1].rung
    quality = f", quality {rung.quality}" if rung.quality else ""
    size = f", {rung.width_px}x{rung.height_px}" if rung.width_px else ""
    where = f"on rung {rung.index} of {rung.last}" if rung.index else "as it was asked for"
    how = f"{1e9 / rung.period_ns:.3g} frames/s{quality}{size}"
    return [f"board camera: {where} ({how}), changed {rung.changes} times by what the link carries"]
