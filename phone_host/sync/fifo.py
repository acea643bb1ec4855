"""The bounded FIFO between pairing and processing. Pure; `stream/pair_queue.py` adds the lock."""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from common.errors import SettingsError

T = TypeVar("T")


class Overflow(Enum):
    """What happens when a pair finds the queue full."""

    DROP_OLDEST = "drop-oldest"
    DROP_NEWEST = "drop-newest"
    BLOCK = "block"


@dataclass(frozen=True, slots=True)
class FifoSettings:
    """Depth and overflow policy.

    Attributes:
        depth: greatest number of waiting pairs, at least 1.
        overflow: overflow policy.
    """

    depth: int = 1
    overflow: Overflow = Overflow.DROP_OLDEST

    @classmethod
    def parse(cls, text: str) -> "FifoSettings":
        """Parse DEPTH or DEPTH:POLICY, for example `2:block`. `oldest` and `newest` are short for the drop policies.

        Raises:
            SettingsError: the text has neither form.
        """
        depth, colon, policy = text.partition(":")
        short = {"oldest": "drop-oldest", "newest": "drop-newest"}
        full = short.get(policy, policy) if colon else Overflow.DROP_OLDEST.value
        # Four digits at most: int() itself raises for thousands of digits.
        sound_depth = depth.isascii() and depth.isdigit() and len(depth) <= 4 and 1 <= int(depth) <= 1000
        if not sound_depth or full not in {item.value for item in Overflow}:
            raise SettingsError(
                f"--fifo {text!r} is not of the form DEPTH:POLICY",
                "give a depth from 1 to 1000, a colon, and drop-oldest, drop-newest or block",
            )
        return cls(int(depth), Overflow(full))


class Fifo(Generic[T]):
    """Keeps the order and never holds more than its depth."""

    def __init__(self, settings: FifoSettings) -> None:
        self._settings = settings
        self._items: deque[T] = deque()

    def __len__(self) -> int:
        return len(self._items)

    @property
    def free(self) -> int:
        """Places left."""
        return self._settings.depth - len(self._items)

    def put(self, item: T) -> list[T]:
        """Queue an item.

        Returns: The dropped items, perhaps including this one. With `block`, credit holds the source back, so a full
            queue means that the source sends without credit. Then the newest item is dropped, too.
        """
        dropped: list[T] = []
        if not self.free and self._settings.overflow is not Overflow.DROP_OLDEST:
            return [item]
        if not self.free:
            dropped.append(self._items.popleft())
        self._items.append(item)
        return dropped

    def take(self) -> T:
        """Remove and return the oldest item.

        Raises:
            IndexError: the queue is empty.
        """
        return self._items.popleft()
