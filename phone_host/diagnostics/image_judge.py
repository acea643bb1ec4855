"""Judges a run's evidence as it comes: which doubts stand, since when, over which pairs, and which figures the verdict speaks of. Pure.

What stood for a while and has gone is no reason to doubt the newest depth, but the pairs of that while are as wrong as
ever, and some of them may be saved. Only a judged pair is called wrong. A pair between two wrong ones is perhaps wrong,
and of one that lies between a wrong and a sound one nothing is known.
"""

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from common.diagnostic import Diagnostic
from common.words import counted
from phone_host.diagnostics.codes import Code, gravest_first
from phone_host.diagnostics.image_rules import ImageFigures, image_doubts, median_figures
from phone_host.model import Evidence, StereoGeometry

_LEAST_JUDGEMENTS: Final = 2
"""A doubt of a single judgement is forgotten: it may be the camera's first image, before its exposure has settled."""

_MOST: Final = 100
"""This many past doubts are remembered, the latest: a lamp that flickers for a day must not fill the memory."""

_MOST_JUDGED: Final = 1000
"""The numbers of this many judged pairs of one while are kept, the latest: eight minutes at two judgements a second."""

_MOST_TOLD: Final = 5

_MOST_SAVED: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """One while during which a doubt stood.

    Attributes:
        concern: the doubt, with its latest figures.
        from_s: when it was first seen, counted from the start of the run, s.
        to_s: when it was seen to be gone, or judged for the last time, s.
        first_pair: the first judged pair with the doubt.
        last_pair: the last judged pair with the doubt.
        is_over: whether it has gone.
        judged: numbers of the judged pairs with the doubt, ascending, the latest `_MOST_JUDGED`.
        judgements: how many there were.
        sound: numbers of the judged pairs without the doubt since it was first seen, kept like `judged`.
    """

    concern: Diagnostic
    from_s: float
    to_s: float
    first_pair: int
    last_pair: int
    is_over: bool
    judged: tuple[int, ...] = ()
    judgements: int = 1
    sound: tuple[int, ...] = ()


class DoubtHistory:
    """Follows the doubts from judgement to judgement."""

    def __init__(self) -> None:
        # Doubts that hold, or have held so recently that they may return.
        self._open: dict[str, Episode] = {}
        self._over: deque[Episode] = deque(maxlen=_MOST)

    def add(self, found: Sequence[Diagnostic], standing: frozenset[str], at_s: float, pair: int) -> None:
        """Take one judgement.

        Args:
            found: the doubts of the judged pair.
            standing: the doubts that stand after this judgement.
            at_s: when the pair was done, counted from the start of the run, s.
            pair: its number in the run, from 0.
        """
        here = {concern.code: concern for concern in found}
        for doubt, concern in here.items():
            self._see(doubt, concern, at_s, pair)
        for doubt, known in tuple(self._open.items()):
            if doubt in here:
                continue
            sound = (*known.sound[1 - _MOST_JUDGED :], pair)
            gone = replace(known, to_s=known.to_s if known.is_over else at_s, is_over=True, sound=sound)
            self._open[doubt] = gone
            if doubt not in standing:
                del self._open[doubt]
                if gone.judgements >= _LEAST_JUDGEMENTS:
                    self._over.append(gone)

    def _see(self, doubt: str, concern: Diagnostic, at_s: float, pair: int) -> None:
        known = self._open.get(doubt)
        if known is None:
            self._open[doubt] = Episode(
                concern=concern, from_s=at_s, to_s=at_s, first_pair=pair, last_pair=pair, is_over=False, judged=(pair,)
            )
            return
        self._open[doubt] = replace(
            known,
            concern=concern,
            to_s=at_s,
            last_pair=pair,
            is_over=False,
            judged=(*known.judged[1 - _MOST_JUDGED :], pair),
            judgements=known.judgements + 1,
        )

    def episodes(self, standing: frozenset[str]) -> tuple[Episode, ...]:
        """Return what stood and what stands, in order of beginning."""
        now = [replace(known, is_over=False) for doubt, known in self._open.items() if doubt in standing]
        return tuple(sorted((*self._over, *now), key=lambda episode: episode.from_s))


def past(history: Sequence[Episode]) -> tuple[Episode, ...]:
    """Return what has gone, gravest first."""
    return tuple(sorted((item for item in history if item.is_over), key=lambda item: not item.concern.is_failure))


def past_seconds(history: Sequence[Episode]) -> float:
    """Return for how long at least one doubt stood that has gone, s."""
    total, reached_s = 0.0, 0.0
    for item in sorted(past(history), key=lambda item: item.from_s):
        total += max(0.0, item.to_s - max(item.from_s, reached_s))
        reached_s = max(reached_s, item.to_s)
    return total


def told_past(history: Sequence[Episode], pairs: int, save_every: int) -> list[tuple[Diagnostic, str]]:
    """Return the gravest of what stood for a while and has gone, each with one line that says so. `save_every` 0: no pair was saved."""
    return [(item.concern, _line(item, pairs, save_every)) for item in past(history)[:_MOST_TOLD]]


def history_lines(history: Sequence[Episode], pairs: int, save_every: int) -> list[str]:
    """Say what stood for a while and has gone, in one line each.

    Args:
        history: of the run.
        pairs: number of processed pairs.
        save_every: every Nth pair was saved, beginning with the first; 0: none.
    """
    lines = [line for _, line in told_past(history, pairs, save_every)]
    more = len(past(history)) - _MOST_TOLD
    return [
        *lines,
        *([f"{counted(more, 'more doubt')} lasted for a while: see trust.history in report.json"] if more > 0 else []),
    ]


def _line(item: Episode, pairs: int, save_every: int) -> str:
    verdict = "wrong" if item.concern.is_failure else "doubtful"
    sound = sum(number < item.last_pair for number in item.sound)
    between = item.last_pair - item.first_pair + 1 - item.judgements - sound
    unjudged = f", {counted(between, 'pair')} between them not judged" if between else ""
    saved = saved_pairs(item, save_every)
    parts = (_numbers(saved.judged, verdict), _numbers(saved.between, "not judged"))
    listed = "; ".join(filter(None, parts))
    return (
        f"from {item.from_s:.1f} s to {item.to_s:.1f} s {item.concern.message}:"
        f" {item.judgements} judged {'pair' if item.judgements == 1 else 'pairs'} of {pairs} {'is' if item.judgements == 1 else 'are'} {verdict}{unjudged}"
        f"{f' (saved: {listed})' if listed else ''}"
    )


def _numbers(pairs: Sequence[int], what: str) -> str:
    """Name some pairs: `pairs 6, 9 wrong`; empty if there are none."""
    if not pairs:
        return ""
    more = f" and {len(pairs) - _MOST_SAVED} more" if len(pairs) > _MOST_SAVED else ""
    names = ", ".join(str(number) for number in pairs[:_MOST_SAVED])
    return f"{'pair' if len(pairs) == 1 else 'pairs'} {names}{more} {what}"


@dataclass(frozen=True, slots=True)
class SavedPairs:
    """Numbers of the saved pairs that a while concerns.

    Attributes:
        judged: those that had the doubt themselves.
        between: those that were not judged and lie between two that had it.
    """

    judged: tuple[int, ...]
    between: tuple[int, ...]


def saved_pairs(item: Episode, save_every: int) -> SavedPairs:
    """Return the numbers of the saved pairs that a while concerns.

    Args:
        item: the while.
        save_every: every Nth pair was saved, beginning with the first; 0: none.
    """
    if not save_every:
        return SavedPairs((), ())
    judged = frozenset(item.judged)
    saved = range(-(-item.first_pair // save_every) * save_every, item.last_pair + 1, save_every)
    known = judged | frozenset(item.sound)
    return SavedPairs(
        tuple(number for number in saved if number in judged), tuple(number for number in saved if number not in known)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageTrust:
    """What a run's images say about its depth.

    Attributes:
        judged: number of judged pairs.
        wants_depth: whether a rig or rectified images were given.
        has_depth: whether any pair had depth.
        start: figures over the first judgements.
        now: figures over those of the latest ones that have exactly the standing doubts.
        concerns: the standing doubts, gravest first.
        newest: the doubts of the newest judged pair, gravest first.
        history: what stood for a while, and what stands.
        geometry: converts disparity to metres; None if it is not known.
        disparity_error_px: error of a disparity, px; NaN if the core states none.
    """

    judged: int = 0
    wants_depth: bool = False
    has_depth: bool = False
    start: ImageFigures = field(default_factory=ImageFigures)
    now: ImageFigures = field(default_factory=ImageFigures)
    concerns: tuple[Diagnostic, ...] = ()
    newest: tuple[Diagnostic, ...] = ()
    history: tuple[Episode, ...] = ()
    geometry: StereoGeometry | None = None
    disparity_error_px: float = math.nan

    @property
    def is_settled(self) -> bool:
        """Whether the newest judged pair has exactly the standing doubts."""
        return {concern.code for concern in self.newest} == {concern.code for concern in self.concerns}


_LAST: Final = 3
"""A doubt stands while it holds in most of the latest three judgements: two a second make that a second."""

_START: Final = 10
"""Figures at the start are medians over this many judgements, five seconds."""

_Judgement = tuple[Evidence, tuple[Diagnostic, ...]]


class ImageJudge:
    """Judges a run's evidence as it comes. One thread adds; the caller guards against others."""

    def __init__(self) -> None:
        self._judged = 0
        self._first: list[_Judgement] = []
        self._latest: deque[_Judgement] = deque(maxlen=_LAST)
        self._history = DoubtHistory()

    def add(self, evidence: Evidence, *, at_s: float, pair: int) -> None:
        """Take the evidence of one pair.

        Args:
            evidence: of the pair.
            at_s: when it was done, counted from the start of the run, s.
            pair: its number in the run, from 0.
        """
        self._judged += 1
        judgement = (evidence, image_doubts(evidence))
        if len(self._first) < _START:
            self._first.append(judgement)
        self._latest.append(judgement)
        self._history.add(judgement[1], self._standing, at_s, pair)

    @property
    def judged(self) -> int:
        """Number of judged pairs."""
        return self._judged

    @property
    def start(self) -> ImageFigures:
        """Figures over the first judgements, up to the first one that is of another opinion: no scene is an average of two."""
        alike = []
        for evidence, found in self._first:
            if _doubts(found) != _doubts(self._first[0][1]):
                break
            alike.append(evidence)
        return median_figures(alike)

    @property
    def now(self) -> ImageFigures:
        """Figures over those of the latest judgements that have exactly the standing doubts; if none has, the newest one's."""
        alike = [evidence for evidence, found in self._latest if _doubts(found) == self._standing]
        return median_figures(alike or [evidence for evidence, _ in self._latest][-1:])

    @property
    def concerns(self) -> tuple[Diagnostic, ...]:
        """The doubts that hold in most of the latest judgements, with their latest figures, gravest first."""
        latest = {concern.code: concern for _, found in self._latest for concern in found}
        return gravest_first(tuple(latest[doubt] for doubt in Code if doubt in self._standing))

    @property
    def newest(self) -> tuple[Diagnostic, ...]:
        """The doubts of the newest judgement, gravest first."""
        return gravest_first(self._latest[-1][1]) if self._latest else ()

    @property
    def history(self) -> tuple[Episode, ...]:
        """What stood for a while, and what stands."""
        return self._history.episodes(self._standing)

    @property
    def _standing(self) -> frozenset[str]:
        counts = Counter(concern.code for _, found in self._latest for concern in found)
        standing = frozenset(doubt for doubt, count in counts.items() if 2 * count > len(self._latest))
        doubtful = sum(1 for _, found in self._latest if found)
        # Most are doubtful, each for another reason: the newest reason is as good as any.
        return standing or (_doubts(self._latest[-1][1]) if 2 * doubtful > len(self._latest) else frozenset())


def _doubts(found: tuple[Diagnostic, ...]) -> frozenset[str]:
    return frozenset(concern.code for concern in found)
