"""Says once what a run waits for, where no live table does."""

from collections.abc import Callable, Sequence
from typing import Final

from common import now
from phone_host.measure.trouble import Trouble

_SOON_NS: Final = 1_000_000_000
"""A board that is there is met within a fifth of this; then there is nothing to say."""


class WaitingNote:
    """One line, written if no board has been met after a second, and one as soon as a board refuses this host.

    Args:
        links: addresses at which the board is looked for.
        has_met_board: whether a board has said hello.
        refused: why the board refuses this host; None if it does not.
        say: takes a line.
    """

    def __init__(
        self,
        links: Sequence[str],
        has_met_board: Callable[[], bool],
        refused: Callable[[], Trouble | None],
        say: Callable[[str], None],
    ) -> None:
        self._line = f"phone-host: waiting for a board at {' and '.join(links)}"
        self._has_met_board, self._refused, self._say = has_met_board, refused, say
        self._told: Trouble | None = None
        self._due_ns: int | None = now.monotonic_ns() + _SOON_NS

    def refresh(self) -> None:
        """Write what is due. Called several times a second."""
        refused = self._refused()
        if refused is not None and refused != self._told:
            self._told, self._due_ns = refused, None
            self._say(f"phone-host: waiting: {refused.problem}: {refused.remedy}")
        if self._due_ns is None or now.monotonic_ns() < self._due_ns:
            return
        self._due_ns = None
        if not self._has_met_board():
            self._say(self._line)
