"""Says how the pairs of a run were searched where the last pair may narrow the search. Pure."""

from typing import Final

from common.words import counted
from phone_host.model import SearchedAs, TemporalAccount

_WHY: Final = {
    SearchedAs.FIRST: "first of their size",
    SearchedAs.DUE: "due",
    SearchedAs.ELSEWHERE: "fitted better elsewhere",
    SearchedAs.WIDE: "need most of the range",
    SearchedAs.EMPTY: "after a pair without depth",
}


def temporal_lines(account: TemporalAccount | None) -> list[str]:
    """Say in one line how many pairs were searched in a part of the range, and why the others were not; nothing without --temporal.

    Args:
        account: of the run; None: every pair was searched in full because nobody asked for less.
    """
    if account is None or not account.pairs:
        return []
    reasons = [f"{account.of(why)} {words}" for why, words in _WHY.items() if account.of(why)]
    full = account.pairs - account.narrowed
    told = f"{full} in full ({', '.join(reasons)})" if reasons else "none in full"
    narrowed = f"{account.narrowed} of {counted(account.pairs, 'pair')} searched where the last one found something"
    return [f"temporal: {narrowed}, {told}; {account.share:.0%} of the disparities on average"]
