"""How much of the search range was looked at where the last pair may narrow it. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum


class SearchedAs(Enum):
    """Why a pair was searched as it was.

    NARROWED: in the range that the last pair left. All others mean the full range. FIRST: there is no earlier pair of this
    size. DUE: so many pairs were narrowed that one is searched in full. ELSEWHERE: the pair's own images fit better outside
    that range. WIDE: the last pair needs so much of the range that narrowing would save nothing. EMPTY: the last pair
    has no depth.
    """

    NARROWED = "narrowed"
    FIRST = "first"
    DUE = "due"
    ELSEWHERE = "elsewhere"
    WIDE = "wide"
    EMPTY = "empty"


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """The part of the search range that was looked at for one pair.

    Attributes:
        why: whether and why it was narrowed or not.
        share: of the disparities, in (0, 1]; 1 = the full range.
    """

    why: SearchedAs
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TemporalAccount:
    """How the pairs of a run were searched.

    Attributes:
        counts: number of pairs for each reason, in the order of `SearchedAs`.
        share_sum: sum of the shares of the disparities that were looked at.
    """

    counts: tuple[int, ...] = (0,) * len(SearchedAs)
    share_sum: float = 0.0

    @property
    def pairs(self) -> int:
        """Number of pairs."""
        return sum(self.counts)

    @property
    def narrowed(self) -> int:
        """Number of pairs that were searched in a part of the range."""
        return self.of(SearchedAs.NARROWED)

    @property
    def share(self) -> float:
        """Mean share of the disparities that were looked at; NaN without pairs."""
        return self.share_sum / self.pairs if self.pairs else float("nan")

    def of(self, why: SearchedAs) -> int:
        """Return the number of pairs that were searched for this reason."""
        return self.counts[list(SearchedAs).index(why)]

    def plus(self, searched: Searched) -> "TemporalAccount":
        """Return the account with one more pair."""
        counts = tuple(count + (why is searched.why) for count, why in zip(self.counts, SearchedAs, strict=True))
        return TemporalAccount(counts=counts, share_sum=self.share_sum + searched.share)
