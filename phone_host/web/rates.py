"""Limits how often each address may ask. Pure."""

from collections import OrderedDict
from collections.abc import Hashable
from typing import Final

_MOST_ASKERS: Final = 512
"""Beyond this many, the one that asked longest ago is forgotten; an attacker with so many addresses is no neighbour."""


class Rate:
    """A bucket that fills evenly; each request takes one from it.

    Args:
        per_s: how fast it fills, 1/s.
        burst: what it holds.
        now_s: now, s; it begins full.
    """

    __slots__ = ("_at_s", "_burst", "_left", "_per_s")

    def __init__(self, per_s: float, burst: float, now_s: float) -> None:
        self._per_s, self._burst, self._left, self._at_s = per_s, burst, burst, now_s

    def take(self, now_s: float) -> bool:
        """Take one.

        Args:
            now_s: now, s, on a clock that never goes back.

        Returns:
            Whether there was one.
        """
        self._left = min(self._burst, self._left + (now_s - self._at_s) * self._per_s)
        self._at_s = now_s
        if self._left < 1:
            return False
        self._left -= 1
        return True


class Rates:
    """One rate for each asker.

    Args:
        per_s: requests of each, 1/s.
        burst: requests of each at once.
    """

    def __init__(self, per_s: float, burst: float) -> None:
        self._per_s, self._burst = per_s, burst
        self._of: OrderedDict[Hashable, Rate] = OrderedDict()

    def take(self, asker: Hashable, now_s: float) -> bool:
        """Say whether an asker may ask now."""
        rate = self._of.pop(asker, None) or Rate(self._per_s, self._burst, now_s)
        self._of[asker] = rate
        if len(self._of) > _MOST_ASKERS:
            self._of.popitem(last=False)
        return rate.take(now_s)
