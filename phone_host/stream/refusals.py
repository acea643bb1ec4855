"""Boards that refuse this host: which refusal counts now, which were reported, and what they mean. How a board is asked to hold its camera. Pure."""

from dataclasses import dataclass
from typing import Final, assert_never

from common.protocol.message import Locks, LockState, RefusalReason
from common.versions import PROTOCOL_VERSION

_RETRY_NS: Final = 1_000_000_000
"""A board sets controls at most twice a second, and some webcams take as long to do it."""


class LockAsking:
    """Asks a board until it answers.

    Attributes:
        wanted: the controls with their values; empty: nothing is asked.
        state: what the board has said in this session; None: nothing yet.
    """

    def __init__(self) -> None:
        self.wanted: Locks = ()
        self.state: LockState | None = None
        self._due_ns = 0

    @property
    def is_answered(self) -> bool:
        """Whether the board has said what became of what is wanted."""
        return self.state is not None and dict(self.state.asked) == dict(self.wanted)

    def want(self, locks: Locks) -> None:
        """Take note of what is wanted from now on."""
        self.wanted, self._due_ns = locks, 0

    def begin(self) -> None:
        """A board session begins: its camera is held in its own way until it is asked."""
        self.state, self._due_ns = None, 0

    def told(self, state: LockState) -> None:
        """Take note of what the board says."""
        self.state = state

    def is_due(self, now_ns: int) -> bool:
        """Return whether to ask now."""
        if not self.wanted or self.is_answered or now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + _RETRY_NS
        return True


_REFUSAL_NS: Final = 1_000_000_000
"""A board refuses at every hello, five times a second. If it has not refused for this long, it is gone."""


@dataclass(frozen=True, slots=True)
class BoardRefusal:
    """Why a board refuses this host.

    Attributes:
        reason: the board's reason, or that it speaks another protocol version.
        protocol: that version, if the board told it. Boards of 0.1 refuse in our own version's format and tell none.
    """

    reason: RefusalReason
    protocol: int | None = None


class Refusals:
    """The recent refusals by boards."""

    def __init__(self) -> None:
        self._last: tuple[BoardRefusal, int] | None = None
        self._told: set[int] = set()

    def last(self, now_ns: int) -> BoardRefusal | None:
        """Return why the last board heard refuses this host; None if it does not, or is silent now.

        Safe from any thread.

        Args:
            now_ns: host's clock, ns.
        """
        last = self._last  # read once, because another thread may write
        return None if last is None or now_ns - last[1] > _REFUSAL_NS else last[0]

    def note(self, refusal: BoardRefusal, now_ns: int) -> None:
        """Take note of a refusal. If it tells no version, a recent one for the same reason is kept instead.

        Args:
            refusal: the board's refusal.
            now_ns: its arrival, host's clock, ns.
        """
        before = self.last(now_ns)
        if before is not None and before.reason is refusal.reason and refusal.protocol is None:
            refusal = before
        self._last = (refusal, now_ns)

    def accepted(self) -> None:
        """Take note that a board has accepted this host."""
        self._last = None

    def is_news(self, link: int) -> bool:
        """Return whether to report a refusal on a link. It is reported once, until the link comes up again."""
        if link in self._told:
            return False
        self._told.add(link)
        return True

    def link_up(self, link: int) -> None:
        """Take note that a link came up: report its next refusal again."""
        self._told.discard(link)


def refusal_text(refusal: BoardRefusal) -> tuple[str, str]:
    """Describe a refusal and its remedy."""
    match refusal.reason:
        case RefusalReason.BUSY:
            return (
                "the board is busy with another host",
                "stop that one first, because a board serves one host at a time",
            )
        case RefusalReason.VERSION:
            # The same words as in `other_protocol`, written out: tests/docs/troubleshooting.py reads them.
            theirs, ours = refusal.protocol, PROTOCOL_VERSION
            if theirs is None:  # a board of 0.1, at most protocol 3: ours is newer, or it would accept us
                return (
                    f"the board speaks an older protocol than {ours}, which this host speaks",
                    "update the board's tandemscan",
                )
            if theirs < ours:
                return f"the board speaks protocol {theirs}, this host protocol {ours}", "update the board's tandemscan"
            return f"the board speaks protocol {theirs}, this host protocol {ours}", "update this host's tandemscan"
        case _:
            assert_never(refusal.reason)
