"""The frames of one life of a board, as the host counts them: which is next, which had credit, which are given up. No I/O."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from common.protocol.message import BoardCounts, BoardHello, Rung
from common.protocol.session import StaleReason

_MOST_MISSING: Final = 64
"""How many lost frames are remembered, so that a late one is not taken for a duplicate. More than any link holds."""


@dataclass(slots=True)
class Stream:
    """The frames of one life of the board. Nothing here outlives that life.

    Attributes:
        hello: what the board said about itself when its frames were last accepted.
        changes: how often its camera had been reconfigured, as far as the board has told.
        next_index: index of the next expected frame.
        below_index: credit granted since frames were last accepted, as the index below which the board may send.
        granted_index: the same over the whole life. No honest frame has this index or a higher one.
        missing: frames recently given up as lost.
    """

    hello: BoardHello
    changes: int
    next_index: int
    below_index: int = 0
    granted_index: int = 0
    missing: deque[int] = field(default_factory=lambda: deque(maxlen=_MOST_MISSING))

    def pass_over(self, index: int) -> int:
        """Give up the frames below an index that have not come; return how many."""
        lost = max(0, index - self.next_index)
        self.missing.extend(range(max(self.next_index, index - _MOST_MISSING), index))
        self.next_index += lost
        return lost

    def take(self, index: int) -> int | StaleReason:
        """Take a frame of this life.

        Returns:
            How many frames before it are given up as lost, or why this frame was not expected.
        """
        if index >= self.granted_index:
            return StaleReason.BEYOND_CREDIT
        if index < self.next_index:
            if index not in self.missing:
                return StaleReason.DUPLICATE
            self.missing.remove(index)
            return StaleReason.LATE
        lost = self.pass_over(index) if index > self.next_index else 0
        self.next_index = index + 1
        return lost

    def is_news(self, rung: Rung) -> bool:
        """Record the camera's rung; return whether it is newer than the last one known. Two lanes may overtake each other."""
        if rung.changes <= self.changes:
            return False
        self.changes = rung.changes
        return True

    def resume(self, hello: BoardHello) -> int:
        """Handle a hello of the same life. Frames beyond the credit went to another host that was there in between; they are not lost."""
        lost = self.pass_over(min(hello.counts.sent, self.granted_index))
        self.next_index = max(self.next_index, hello.counts.sent)
        self.granted_index = max(self.granted_index, hello.counts.sent)
        self.below_index = 0
        return lost

    def can_be(self, counts: BoardCounts) -> bool:
        """Whether an account can be true: a board sends no more than its credit."""
        return counts.sent <= self.granted_index
