"""Judges a run's evidence as it comes: which doubts stand, since when, and which figures the verdict speaks of. Pure."""

from collections import Counter, deque
from typing import Final

from phone_host.measure.doubt_history import DoubtHistory, Episode
from phone_host.measure.image_doubts import image_doubts
from phone_host.measure.image_trust import ImageFigures, median_figures
from phone_host.measure.trust import Concern, Doubt, gravest_first
from phone_host.model import Evidence

_LAST: Final = 3
"""A doubt stands while it holds in most of the latest three judgements: two a second make that a second."""

_START: Final = 10
"""Figures at the start are medians over this many judgements, five seconds."""

_Judgement = tuple[Evidence, tuple[Concern, ...]]


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
    def concerns(self) -> tuple[Concern, ...]:
        """The doubts that hold in most of the latest judgements, with their latest figures, gravest first."""
        latest = {concern.doubt: concern for _, found in self._latest for concern in found}
        return gravest_first(tuple(latest[doubt] for doubt in Doubt if doubt in self._standing))

    @property
    def newest(self) -> tuple[Concern, ...]:
        """The doubts of the newest judgement, gravest first."""
        return gravest_first(self._latest[-1][1]) if self._latest else ()

    @property
    def history(self) -> tuple[Episode, ...]:
        """What stood for a while, and what stands."""
        return self._history.episodes(self._standing)

    @property
    def _standing(self) -> frozenset[Doubt]:
        counts = Counter(concern.doubt for _, found in self._latest for concern in found)
        standing = frozenset(doubt for doubt, count in counts.items() if 2 * count > len(self._latest))
        doubtful = sum(1 for _, found in self._latest if found)
        # Most are doubtful, each for another reason: the newest reason is as good as any.
        return standing or (_doubts(self._latest[-1][1]) if 2 * doubtful > len(self._latest) else frozenset())


def _doubts(found: tuple[Concern, ...]) -> frozenset[Doubt]:
    return frozenset(concern.doubt for concern in found)
