"""All that the guide says, in a few words each; what `wants` says beside; and how long words stand. Pure."""

from enum import Enum
from typing import Final

from common.words import counted


class Words(Enum):
    """What a person is told; beside these: what a wanted view lacks, and `taken`."""

    SHOW_BOTH = "show the whole board to both cameras"
    SHOW_LEFT = "the left camera sees too little of the board: move it to the left, or farther away"
    SHOW_RIGHT = "the right camera sees too little of the board: move it to the right, or farther away"
    PART = "show more of the board"
    SAME = "both cameras show the same picture: choose two different cameras"
    HELP = "no board found: more light, no glare, the whole board with its white margin; or name its inner corners"
    STILL = "hold still"
    BLURRED = "too blurred: hold still, more light"
    GLARE = "glare: turn the board a little"
    ELSEWHERE = "move the board a little"


def taken(views: int) -> str:
    """Return what is said when a view is taken."""
    return f"taken, {views}"


def done(verdict: str, views: int) -> str:
    """Return what is said at the end."""
    return f"done: verdict {verdict}" if verdict else f"done: {counted(views, 'view')}"


_STEADY_NS: Final = 400_000_000
"""The reason for new words must last so long: a board may be between two looks."""

_READ_NS: Final = 1_000_000_000
"""So long words stand: nobody reads, or follows, what changes faster."""


class Speech:
    """What is being said. Words change only when a person has had the time to read them."""

    def __init__(self) -> None:
        self.words = ""
        self._since_ns = self._next_since_ns = 0
        self._next = ""

    def say(self, wanted: str, now_ns: int, *, is_news: bool) -> str:
        """Return what is said now.

        Args:
            wanted: what is to be said; empty: nothing new.
            now_ns: now.
            is_news: whether it is said at once, whatever stands: a view was taken, or all is done.
        """
        if wanted != self._next:
            self._next, self._next_since_ns = wanted, now_ns
        if not wanted or wanted == self.words:
            return self.words
        # A hand that is to hold still has gone on a moment later.
        is_steady = wanted == Words.STILL.value or now_ns - self._next_since_ns >= _STEADY_NS
        if is_news or not self.words or (is_steady and now_ns - self._since_ns >= _READ_NS):
            self.words, self._since_ns = wanted, now_ns
        return self.words
