"""Who is at the other end of a wire. A wire cannot tell that a program has gone, or that another has taken its place. Sans-I/O.

The dialler says OPEN with a number that it has never used, until it hears ACCEPT with that number. Nothing else is sent before. The listener
treats every new number as a new contact, and says WHO to a dialler that it does not know. Each side says CLOSE when it leaves. A wire
preserves the order of bytes, so everything after the first OPEN or ACCEPT of a number belongs to that contact and nothing before it does.
"""

import struct
from collections import deque
from enum import Enum
from typing import Final

from common.protocol.framing import LinkEnd, Unit, UnitKind

_WORD: Final = struct.Struct("<BI")
_NEVER: Final = 2**63 - 1
_NUMBERS: Final = 1 << 32

RETRY_NS: Final = 100_000_000
"""Time between two attempts to be heard. A peer that comes back is met within this time."""

_MOST_WAITING: Final = 4
"""Words that may wait for room on the line. Only the newest of a kind matters, and a peer that talks without reading must not fill memory."""


class News(Enum):
    """What a word meant."""

    NONE = 0
    MET = 1
    PARTED = 2


class _Word(Enum):
    OPEN = 0
    ACCEPT = 1
    WHO = 2
    CLOSE = 3


class Contact:
    """What one side knows about the other.

    Args:
        side: which end this is.
        number: random, below 2^32, so that no earlier life of this side has used it.
    """

    def __init__(self, side: LinkEnd, number: int) -> None:
        self._dials = side is LinkEnd.DIALLER
        self._number = number if self._dials else None
        self._up = False
        self._due_ns = 0
        self._say: deque[tuple[_Word, int]] = deque([] if self._dials else [(_Word.WHO, 0)], _MOST_WAITING)

    @property
    def is_up(self) -> bool:
        """Whether the two sides have met."""
        return self._up

    @property
    def number(self) -> int:
        """The contact's number."""
        return self._number or 0

    @property
    def due_ns(self) -> int:
        """When `words` must be called next, ns; 2^63 - 1: never."""
        if self._say:
            return 0
        return self._due_ns if self._dials and not self._up else _NEVER

    def hear(self, body: bytes) -> News:
        """Handle a CONTACT unit's body."""
        if len(body) != _WORD.size:
            return News.NONE
        value, number = _WORD.unpack(body)
        if value >= len(_Word):
            return News.NONE
        word = _Word(value)
        return self._hear_as_dialler(word, number) if self._dials else self._hear_as_listener(word, number)

    def hear_stranger(self, now_ns: int) -> None:
        """As listener, handle a unit from a dialler that this side does not know."""
        if not self._dials and now_ns >= self._due_ns:
            self._due_ns = now_ns + RETRY_NS
            self._say.append((_Word.WHO, 0))

    def words(self, now_ns: int) -> list[Unit]:
        """Return what is to be said now."""
        if self._dials and not self._up and now_ns >= self._due_ns:
            self._due_ns = now_ns + RETRY_NS
            self._say.append((_Word.OPEN, self.number))
        said = tuple(self._say)
        self._say.clear()
        return [
            Unit(kind=UnitKind.CONTACT, first=True, last=True, number=0, body=_WORD.pack(word.value, number))
            for word, number in said
        ]

    def leave(self) -> None:
        """Say goodbye next. For the dialler, what follows is a new contact."""
        if self._up:
            self._say.append((_Word.CLOSE, self.number))
        self._lose_peer()

    def interrupt(self) -> None:
        """Record that the line was lost: the other end must be met anew, and cannot be told."""
        self._lose_peer()
        self._say.clear()
        if not self._dials:
            self._say.append((_Word.WHO, 0))

    def _hear_as_dialler(self, word: _Word, number: int) -> News:
        if word is _Word.ACCEPT and number == self._number and not self._up:
            self._up = True
            return News.MET
        if word is _Word.WHO or (word is _Word.CLOSE and number == self._number):
            was_up = self._up
            if was_up:
                self._lose_peer()
            self._due_ns = 0
            return News.PARTED if was_up else News.NONE
        return News.NONE

    def _hear_as_listener(self, word: _Word, number: int) -> News:
        if word is _Word.OPEN:
            self._say.append((_Word.ACCEPT, number))
            if self._up and number == self._number:
                return News.NONE  # a repeated word
            self._number, self._up = number, True
            return News.MET
        if word is _Word.CLOSE and self._up and number == self._number:
            self._lose_peer()
            return News.PARTED
        return News.NONE

    def _lose_peer(self) -> None:
        self._up = False
        self._due_ns = 0
        self._number = (self.number + 1) % _NUMBERS if self._dials else None
