"""Says once what a run waits for, where no live table does."""

from collections.abc import Callable, Sequence
from typing import Final

from common import now

_SOON_NS: Final = 1_000_000_000
"""A board that is there is met within a fifth of this; then there is nothing to say."""


class WaitingNote:
    """One line, written if no board has been met after a second.

    Args:
        links: addresses at which the board is looked for.
        has_met_board: whether a board has said hello.
        say: takes the line.
    """

    def __init__(self, links: Sequence[str], has_met_board: Callable[[], bool], say: Callable[[str], None]) -> None:
        self._line = f"phone-host: waiting for a board at {' and '.join(links)}"
        self._has_met_board, self._say = has_met_board, say
        self._due_ns: int | None = now.monotonic_ns() + _SOON_NS

    def refresh(self) -> None:
        """Write the line if it is due. Called several times a second."""
        if self._due_ns is None or now.monotonic_ns() < self._due_ns:
            return
        self._due_ns = None
        if not self._has_met_board():
            self._say(self._line)
