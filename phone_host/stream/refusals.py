"""Boards that do not talk to this host: which refusal counts now, what was told of them, what they mean. Pure."""

from typing import Final

from common.protocol.message import RefusalReason

_REFUSAL_NS: Final = 1_000_000_000
"""A board that refuses does so at every hello, five times a second; one that has not done so for this long is gone."""


class Refusals:
    """What boards have refused of late."""

    def __init__(self) -> None:
        self._last: tuple[RefusalReason, int] | None = None
        self._told: set[int] = set()

    def last(self, now_ns: int) -> RefusalReason | None:
        """Why the board that was last heard does not talk to us; None when it does, or is silent now. Any thread may ask.

        Args:
            now_ns: host's clock, ns.
        """
        last = self._last  # read once: another thread may be writing
        return None if last is None or now_ns - last[1] > _REFUSAL_NS else last[0]

    def note(self, reason: RefusalReason, now_ns: int) -> None:
        """Take note of a refusal.

        Args:
            reason: the board's.
            now_ns: its arrival, host's clock, ns.
        """
        self._last = (reason, now_ns)

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


def refusal_text(reason: RefusalReason) -> tuple[str, str]:
    """What a refusal means, and its remedy.

    Args:
        reason: the board's.

    Returns:
        Problem and remedy, in words for the user.
    """
    match reason:
        case RefusalReason.BUSY:
            return "the board is busy with another host", "stop the other one first"
        case RefusalReason.VERSION:
            return "the board speaks another protocol version", "update the older of the two"
