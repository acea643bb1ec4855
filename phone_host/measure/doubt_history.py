"""Remembers which doubts stood during a run, when, and over which pairs. Pure.

What stood for a while and has gone is no reason to doubt the newest depth, but the pairs of that while are as wrong as
ever, and some of them may be saved.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from common.words import counted
from phone_host.measure.trust import Concern, Doubt

_LEAST_JUDGEMENTS: Final = 2
"""A doubt of a single judgement is forgotten: it may be the camera's first image, before its exposure has settled."""

_MOST: Final = 100
"""This many past doubts are remembered, the latest: a lamp that flickers for a day must not fill the memory."""

_MOST_TOLD: Final = 5
_MOST_SAVED: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """One while during which a doubt stood.

    Attributes:
        concern: the doubt, with its latest figures.
        from_s: when it was first seen, counted from the start of the run, s.
        to_s: when it was seen to be gone, or judged for the last time, s.
        first_pair: first pair that may be concerned: the one after the last judged pair without the doubt.
        last_pair: last pair that may be concerned.
        is_over: whether it has gone.
    """

    concern: Concern
    from_s: float
    to_s: float
    first_pair: int
    last_pair: int
    is_over: bool

    @property
    def pairs(self) -> int:
        """Number of pairs that may be concerned."""
        return self.last_pair - self.first_pair + 1


@dataclass(slots=True)
class _Open:
    """A doubt that holds, or has held so recently that it may return."""

    episode: Episode
    judgements: int = 1


class DoubtHistory:
    """Follows the doubts from judgement to judgement."""

    def __init__(self) -> None:
        self._open: dict[Doubt, _Open] = {}
        self._over: deque[Episode] = deque(maxlen=_MOST)
        self._next_pair = 0

    def add(self, found: Sequence[Concern], standing: frozenset[Doubt], at_s: float, pair: int) -> None:
        """Take one judgement.

        Args:
            found: the doubts of the judged pair.
            standing: the doubts that stand after this judgement.
            at_s: when the pair was done, counted from the start of the run, s.
            pair: its number in the run, from 0.
        """
        here = {concern.doubt: concern for concern in found}
        for doubt, concern in here.items():
            self._see(doubt, concern, at_s, pair)
        for doubt, known in tuple(self._open.items()):
            if doubt in here:
                continue
            if not known.episode.is_over:
                known.episode = replace(known.episode, to_s=at_s, last_pair=pair - 1, is_over=True)
            if doubt not in standing:
                del self._open[doubt]
                if known.judgements >= _LEAST_JUDGEMENTS:
                    self._over.append(known.episode)
        self._next_pair = pair + 1

    def _see(self, doubt: Doubt, concern: Concern, at_s: float, pair: int) -> None:
        known = self._open.get(doubt)
        if known is None:
            first = min(self._next_pair, pair)
            self._open[doubt] = _Open(
                Episode(concern=concern, from_s=at_s, to_s=at_s, first_pair=first, last_pair=pair, is_over=False)
            )
            return
        known.judgements += 1
        known.episode = replace(known.episode, concern=concern, to_s=at_s, last_pair=pair, is_over=False)

    def episodes(self, standing: frozenset[Doubt]) -> tuple[Episode, ...]:
        """Return what stood and what stands, in order of beginning.

        Args:
            standing: the doubts that stand now.
        """
        now = [replace(known.episode, is_over=False) for doubt, known in self._open.items() if doubt in standing]
        return tuple(sorted((*self._over, *now), key=lambda episode: episode.from_s))


def past(history: Sequence[Episode]) -> tuple[Episode, ...]:
    """Return what has gone, gravest first."""
    return tuple(sorted((item for item in history if item.is_over), key=lambda item: not item.concern.is_certain))


def past_seconds(history: Sequence[Episode]) -> float:
    """Return for how long at least one doubt stood that has gone, s."""
    total, reached_s = 0.0, 0.0
    for item in sorted(past(history), key=lambda item: item.from_s):
        total += max(0.0, item.to_s - max(item.from_s, reached_s))
        reached_s = max(reached_s, item.to_s)
    return total


def history_lines(history: Sequence[Episode], pairs: int, save_every: int) -> list[str]:
    """Say what stood for a while and has gone, in one line each.

    Args:
        history: of the run.
        pairs: number of processed pairs.
        save_every: every Nth pair was saved, beginning with the first; 0: none.
    """
    gone = past(history)
    lines = [_line(item, pairs, save_every) for item in gone[:_MOST_TOLD]]
    more = len(gone) - _MOST_TOLD
    return [
        *lines,
        *([f"{counted(more, 'more doubt')} stood for a while: see trust.history in report.json"] if more > 0 else []),
    ]


def _line(item: Episode, pairs: int, save_every: int) -> str:
    verdict = "wrong" if item.concern.is_certain else "doubtful"
    saved = saved_pairs(item, save_every)
    names = ", ".join(str(number) for number in saved[:_MOST_SAVED]) + (" ..." if len(saved) > _MOST_SAVED else "")
    among = f", among them saved {'pair' if len(saved) == 1 else 'pairs'} {names}" if saved else ""
    return (
        f"from {item.from_s:.1f} s to {item.to_s:.1f} s {item.concern.sentence}:"
        f" about {item.pairs} of {counted(pairs, 'pair')} are {verdict}{among}"
    )


def saved_pairs(item: Episode, save_every: int) -> range:
    """Return the numbers of the saved pairs that may be concerned.

    Args:
        item: the while.
        save_every: every Nth pair was saved, beginning with the first; 0: none.
    """
    if not save_every:
        return range(0)
    return range(-(-item.first_pair // save_every) * save_every, item.last_pair + 1, save_every)
