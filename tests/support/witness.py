"""Knows when each image of a simulated world was really exposed, and reports pairs that should not have been made."""

from dataclasses import dataclass
from typing import Final

from phone_host.model import FramePair

PERIOD_NS: Final = 33_333_333
"""Period of both cameras."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongPair:
    """A pair whose images were exposed too far apart, although the known state of the clocks said otherwise.

    `excusable`: the clocks had stepped since the last answered echo, and by less than two periods in all when the board
    sent the frame. (A frame under way while the host's machine is stopped looks like any other; only the next echo
    tells.)
    """

    session: str
    sequence: int
    apart_ns: int
    allowed_ns: int
    excusable: bool


class Witness:
    """The truth about a world, apart from what its board and host believe. All times are true, ns, unless a clock is named.

    Args:
        apart_ns: how far the board's clock is ahead of the host's, ns.

    Attributes:
        pairs: how many were judged.
        wrong: those that should not have been made.
    """

    def __init__(self, apart_ns: int) -> None:
        self.pairs = 0
        self.wrong: list[WrongPair] = []
        self._board_exposed: dict[tuple[str, int], int] = {}
        self._host_exposed: dict[int, int] = {}
        self._apart_at_sending: dict[tuple[str, int], int] = {}
        self._bound_ns = 0
        self._asked: dict[int, tuple[int, int]] = {}
        self._asked_ns = self._stepped_ns = self._untold_ns = 0
        self._settled_ns = apart_ns

    @property
    def unsettled(self) -> bool:
        """Whether a clock has stepped and no echo requested since then has been answered."""
        return self._asked_ns < self._stepped_ns

    def board_exposed(self, session: str, sequence: int, true_ns: int) -> None:
        """The board exposed an image."""
        self._board_exposed[session, sequence] = true_ns

    def host_exposed(self, sequence: int, true_ns: int) -> None:
        """The host exposed an image."""
        self._host_exposed[sequence] = true_ns

    def sent(self, session: str, sequence: int, apart_ns: int) -> None:
        """The board sent a frame, with its clock this far ahead of the host's."""
        self._apart_at_sending[session, sequence] = apart_ns

    def stepped(self, true_ns: int) -> None:
        """A clock stepped, or stands still."""
        self._stepped_ns = true_ns

    def slept_untold(self, host_ns: int) -> None:
        """The host's machine falls asleep and will not be told; what arrived before then, by its clock, is not judged."""
        self._untold_ns = host_ns

    def bounded(self, bound_ns: int) -> None:
        """The host assumes that its estimate of the clocks is within this bound."""
        self._bound_ns = max(self._bound_ns, bound_ns)

    def asked(self, wave: int, true_ns: int, apart_ns: int) -> None:
        """The host asked for an echo."""
        self._asked[wave] = true_ns, apart_ns

    def answered(self, wave: int, true_ns: int, swift_ns: int) -> None:
        """An answer came. If it took longer than `swift_ns`, it waited while a program was stopped: no step can be detected from it."""
        asked_ns, apart_ns = self._asked.get(wave, (0, 0))
        if asked_ns > self._asked_ns and true_ns - asked_ns <= swift_ns:
            self._asked_ns, self._settled_ns = asked_ns, apart_ns

    def judge(self, pair: FramePair, tolerance_ns: int) -> None:
        """A pair was made, with a tolerance for the time skew."""
        self.pairs += 1
        message = pair.board.message
        known = message.session, message.sequence
        apart_ns = abs(self._board_exposed[known] - self._host_exposed[pair.host.sequence])
        allowed_ns = tolerance_ns + self._bound_ns
        if apart_ns > allowed_ns and pair.board.received_ns > self._untold_ns:
            stepped_ns = self._apart_at_sending[known] - self._settled_ns
            self.wrong.append(
                WrongPair(
                    session=message.session,
                    sequence=message.sequence,
                    apart_ns=apart_ns,
                    allowed_ns=allowed_ns,
                    excusable=self.unsettled and abs(stepped_ns) < 2 * PERIOD_NS,
                )
            )
