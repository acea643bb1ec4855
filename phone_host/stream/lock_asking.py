"""Which controls the board's camera shall be held at, and what the board says about that. Pure; the time is an argument."""

from typing import Final

from common.protocol.message import Locks, LockState

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
