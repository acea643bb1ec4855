"""The bounded first-in-first-out queue between pairing and processing. Pure; the host's root adds the lock."""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from common.errors import SettingsError

T = TypeVar("T")


class Overflow(Enum):
    """What happens to a pair that finds the queue full."""

    DROP_OLDEST = "drop-oldest"
    DROP_NEWEST = "drop-newest"
    BLOCK = "block"


@dataclass(frozen=True, slots=True)
class FifoSettings:
    """Depth and overflow policy.

    Attributes:
        depth: most pairs that wait, at least 1.
        overflow: what gives way.
    """

    depth: int = 1
    overflow: Overflow = Overflow.DROP_OLDEST

    @classmethod
    def parse(cls, text: str) -> "FifoSettings":
        """Read DEPTH or DEPTH:POLICY, for example `2:block`; `oldest` and `newest` stand for the drop policies.

        Raises:
            SettingsError: it is neither.
        """
        depth, colon, policy = text.partition(":")
        short = {"oldest": "drop-oldest", "newest": "drop-newest"}
        full = short.get(policy, policy) if colon else Overflow.DROP_OLDEST.value
        # Four digits at most: int() itself raises for thousands of them.
        sound_depth = depth.isascii() and depth.isdigit() and len(depth) <= 4 and 1 <= int(depth) <= 1000
        if not sound_depth or full not in {item.value for item in Overflow}:
            raise SettingsError(
                f"--fifo {text!r} is not of the form DEPTH:POLICY",
                "give a depth from 1 to 1000, a colon, and drop-oldest, drop-newest or block",
            )
        return cls(int(depth), Overflow(full))


class Fifo(Generic[T]):
    """Keeps the order; never holds more than its depth.

    Args:
        settings: depth and overflow policy.
    """

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

        Args:
            item: the newest one.

        Returns:
            The items that gave way, perhaps this one; with `block` the source is held back by credit, so that a full queue means a source
            that sends without being asked: then the newest gives way, too.
        """
        dropped: list[T] = []
        if not self.free and self._settings.overflow is not Overflow.DROP_OLDEST:
            return [item]
        if not self.free:
            dropped.append(self._items.popleft())
        self._items.append(item)
        return dropped

    def take(self) -> T:
        """Give the oldest item.

        Raises:
            IndexError: the queue is empty.
        """
        return self._items.popleft()
