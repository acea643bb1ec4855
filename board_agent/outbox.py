"""The one frame that waits for the link, and the account of all frames: grabbed = sent + dropped + waiting."""

from common.frame import Frame
from common.protocol.message import BoardCounts, DropReason


class Outbox:
    """Keeps the newest frame, never a backlog; counts what becomes of each.

    Attributes:
        waiting: the frame that could be sent now; None if there is none.
    """

    def __init__(self) -> None:
        self.waiting: Frame | None = None
        self._grabbed = 0
        self._sent = 0
        self._dropped: dict[DropReason, int] = {}

    @property
    def counts(self) -> BoardCounts:
        """What became of all frames so far."""
        return BoardCounts(self._grabbed, self._sent, tuple(self._dropped.items()))

    def put(self, frame: Frame, *, has_host: bool) -> None:
        """Put in a fresh frame. If one was still waiting, it was not wanted in time and is dropped."""
        self._grabbed += 1
        if self.waiting is not None:
            self._drop(DropReason.REPLACED)
        self.waiting = frame
        if not has_host:
            self.discard(DropReason.NO_HOST)

    def spoiled(self) -> None:
        """Count a grab whose bytes are not a whole image."""
        self._grabbed += 1
        self._drop(DropReason.SPOILED)

    def skipped(self, frames: int = 1) -> None:
        """Count grabs that were replaced by newer ones before anyone looked at them."""
        self._grabbed += frames
        self._drop(DropReason.REPLACED, frames)

    def sent(self) -> None:
        """Record that the link took the waiting frame."""
        assert self.waiting is not None
        self.waiting = None
        self._sent += 1

    def discard(self, reason: DropReason) -> None:
        """Drop the waiting frame, if there is one."""
        if self.waiting is not None:
            self.waiting = None
            self._drop(reason)

    def _drop(self, reason: DropReason, frames: int = 1) -> None:
        self._dropped[reason] = self._dropped.get(reason, 0) + frames
