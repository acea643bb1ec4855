"""The frames of one life of a board, as a host counts them: which one is next, what was allowed, what is given up. No I/O."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from common.protocol.message import BoardCounts, BoardHello, Rung
from common.protocol.session import StaleReason

_MOST_MISSING: Final = 64
"""Lost frames that are remembered, so that one which comes late is not taken for a repetition: more than any link holds."""


@dataclass(slots=True)
class Stream:
    """The frames of one life of the board; nothing of it outlives that.

    Attributes:
        hello: what the board said of itself when its frames were accepted last.
        changes: how often its camera had been set anew, as far as was told.
        next_index: of the frame that is expected next.
        below_index: credit was granted up to here since frames were accepted last.
        granted_index: the same over the whole life: no honest frame has this index or a higher one.
        missing: frames that were given up of late.
    """

    hello: BoardHello
    changes: int
    next_index: int
    below_index: int = 0
    granted_index: int = 0
    missing: deque[int] = field(default_factory=lambda: deque(maxlen=_MOST_MISSING))

    def pass_over(self, index: int) -> int:
        """Give up the frames below an index that have not come; gives how many."""
        lost = max(0, index - self.next_index)
        self.missing.extend(range(max(self.next_index, index - _MOST_MISSING), index))
        self.next_index += lost
        return lost

    def take(self, index: int) -> int | StaleReason:
        """Take a frame of this life.

        Args:
            index: its own, of the frames that were sent.

        Returns:
            How many before it are given up for lost; or why it is none that was waited for.
        """
        if index >= self.granted_index:
            return StaleReason.BEYOND_CREDIT
        if index < self.next_index:
            if index not in self.missing:
                return StaleReason.DUPLICATE
            self.missing.remove(index)
            return StaleReason.LATE
        lost = self.pass_over(index)
        self.next_index = index + 1
        return lost

    def is_news(self, rung: Rung) -> bool:
        """Take note of what the camera is set to; gives whether it was set anew since the last account: two lanes may overtake each other."""
        if rung.changes <= self.changes:
            return False
        self.changes = rung.changes
        return True

    def resume(self, hello: BoardHello) -> int:
        """Take a hello of the same life. Frames beyond the credit went to another host, which was there between; they are not lost."""
        lost = self.pass_over(min(hello.counts.sent, self.granted_index))
        self.next_index = max(self.next_index, hello.counts.sent)
        self.granted_index = max(self.granted_index, hello.counts.sent)
        self.below_index = 0
        return lost

    def can_be(self, counts: BoardCounts) -> bool:
        """Whether an account can be true: a board sends no more than it is allowed to."""
        return counts.sent <= self.granted_index
