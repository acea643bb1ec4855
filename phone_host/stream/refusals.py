"""Boards that do not talk to this host: which refusal counts now, what was told of them, what they mean. Pure."""

from dataclasses import dataclass
from typing import Final

from common.protocol.message import RefusalReason
from common.versions import PROTOCOL_VERSION

_REFUSAL_NS: Final = 1_000_000_000
"""A board that refuses does so at every hello, five times a second; one that has not done so for this long is gone."""


@dataclass(frozen=True, slots=True)
class BoardRefusal:
    """Why a board does not talk to us.

    Attributes:
        reason: its own, or that it speaks another protocol version.
        protocol: that version, where the board has told it; boards of 0.1 refuse in our own version's words and tell none.
    """

    reason: RefusalReason
    protocol: int | None = None


class Refusals:
    """What boards have refused of late."""

    def __init__(self) -> None:
        self._last: tuple[BoardRefusal, int] | None = None
        self._told: set[int] = set()

    def last(self, now_ns: int) -> BoardRefusal | None:
        """Why the board that was last heard does not talk to us; None when it does, or is silent now. Any thread may ask.

        Args:
            now_ns: host's clock, ns.
        """
        last = self._last  # read once: another thread may be writing
        return None if last is None or now_ns - last[1] > _REFUSAL_NS else last[0]

    def note(self, refusal: BoardRefusal, now_ns: int) -> None:
        """Take note of a refusal. One that tells no version follows one that does.

        Args:
            refusal: the board's.
            now_ns: its arrival, host's clock, ns.
        """
        before = self.last(now_ns)
        if before is not None and before.reason is refusal.reason and refusal.protocol is None:
            refusal = before
        self._last = (refusal, now_ns)

    def accepted(self) -> None:
        """Take note that a board talks to us."""
        self._last = None

    def is_news(self, link: int) -> bool:
        """Whether a refusal on a link is to be told: once, until the link has come up.

        Args:
            link: its number.
        """
        if link in self._told:
            return False
        self._told.add(link)
        return True

    def link_up(self, link: int) -> None:
        """Take note that a link came up: a refusal there is news again.

        Args:
            link: its number.
        """
        self._told.discard(link)


def refusal_text(refusal: BoardRefusal) -> tuple[str, str]:
    """What a refusal means, and its remedy.

    Args:
        refusal: the board's.

    Returns:
        Problem and remedy, in words for the user.
    """
    match refusal.reason:
        case RefusalReason.BUSY:
            return "the board is busy with another host", "stop the other one first"
        case RefusalReason.VERSION:
            # The words of `other_protocol`, in full: docs/troubleshooting.md is made from them.
            theirs, ours = refusal.protocol, PROTOCOL_VERSION
            if theirs is None:  # told by no board of 0.1, whose newest was 3: ours is newer, or it would talk to us
                return (
                    f"the board speaks an older protocol than {ours}, which this host speaks",
                    "update the board's tandemscan",
                )
            if theirs < ours:
                return f"the board speaks protocol {theirs}, this host protocol {ours}", "update the board's tandemscan"
            return f"the board speaks protocol {theirs}, this host protocol {ours}", "update this host's tandemscan"
