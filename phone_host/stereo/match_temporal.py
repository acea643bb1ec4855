"""Searches a pair where the last pair found something, if the pair's own images agree: `--temporal`.

The only thing that is taken over from earlier pairs is a range of disparities. Every value is matched anew in the pair's own
images, so nothing of an earlier pair can stay in a later one. The range is never trusted blindly:

1. it gets a margin, for what moves;
2. before it is used, the new images are asked whether some patch fits much better outside it (`match_elsewhere`): then the
   pair is searched in full, as are the first pair, the first of another size, and one of DUE_EVERY;
3. what is searched is a pair without the left image's first columns, whose partners lie outside the right image for each
   disparity of the range: no column is invented, and the search costs less for it, too.

docs/decisions/0037-temporal-and-completed.md says what this gains and what it may miss.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from phone_host.model import (
    Disparity,
    Matched,
    RectifiedPair,
    Searched,
    SearchedAs,
)
from phone_host.stereo.match_elsewhere import Range, fits_elsewhere
from phone_host.stereo.match_input import check_pair, grey
from phone_host.stereo.matcher_protocol import Matcher, matched_by

TAIL_SHARE: Final = 2e-4
"""Share of all pixels that may lie beyond each end of a pair's range: 61 of 640x480; matchers drop islands of up to 42 to 60 px.
A larger patch beyond the range is what `match_elsewhere` finds."""

MARGIN_PX: Final = 8
"""Added on both sides: a hand in half a metre that comes nearer by 1 m/s at 30 pairs/s moves by 7 px (f = 525 px, b = 100 mm)."""

STEP_PX: Final = 16
"""The range is a multiple of this: vectors of 8-bit costs take that many at once, and a range that rests keeps its matcher."""

WIDE_SHARE: Final = 0.8
"""From this share of the full range on, what is saved does not pay for asking the images."""

DUE_EVERY: Final = 30
"""One of so many pairs is searched in full: a second at 30 pairs/s is the longest that something small stays unseen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Last:
    """What is kept of the last pair.

    Attributes:
        shape: of its images.
        range: where it has values, with the margin; None: it has none.
        narrowed: pairs since the last one that was searched in full.
    """

    shape: tuple[int, ...]
    range: Range | None
    narrowed: int


class TemporalMatcher:
    """Matches the pairs of one stream with any matcher, in a narrower range where that is safe. The first pair is always searched in full.

    Args:
        make: returns the matcher for a number of disparities.
        disparities: N >= 1, px: 0 <= d < N is the full range.
    """

    def __init__(self, make: Callable[[int], Matcher], disparities: int) -> None:
        self._make, self._disparities = make, disparities
        self._full = make(disparities)
        self._narrow: tuple[int, Matcher] | None = None
        self._last: _Last | None = None

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`."""
        return self.matched(pair).disparity

    def matched(self, pair: RectifiedPair) -> Matched:
        """Match one pair and tell how it was searched; see `ReportingMatcher.matched`."""
        check_pair(pair)
        shape = pair.left.shape[:2]
        searched = min(self._disparities, shape[1])
        last, self._last = self._last, None  # a pair that fails leaves nothing behind
        why, wanted = _plan(last, shape, searched)
        if wanted is not None and fits_elsewhere(grey(pair.left), grey(pair.right), wanted, searched):
            why, wanted = SearchedAs.ELSEWHERE, None
        if wanted is None:
            found, share = matched_by(self._full, pair), 1.0
        else:
            found, share = self._in_range(pair, wanted), wanted.size_px / searched
        self._last = _Last(
            shape=shape,
            range=range_of(
                found.disparity, searched, None if last is None or why is SearchedAs.ELSEWHERE else last.range
            ),
            narrowed=0 if wanted is None or last is None else last.narrowed + 1,
        )
        return replace(found, report=replace(found.report, searched=Searched(why=why, share=share)))

    def _in_range(self, pair: RectifiedPair, wanted: Range) -> Matched:
        if self._narrow is None or self._narrow[0] != wanted.size_px:
            self._narrow = wanted.size_px, self._make(wanted.size_px)
        low, width = wanted.low_px, pair.left.shape[1]
        # A left column x < low has no partner: x - d < 0 for every d of the range.
        found = matched_by(
            self._narrow[1], RectifiedPair(pair.left[:, low:], pair.right[:, : width - low], pair.epipolar)
        )
        disparity = np.full(pair.left.shape[:2], np.nan, np.float32)
        np.add(found.disparity, np.float32(low), out=disparity[:, low:])
        confidence = found.confidence
        if confidence is not None:
            whole = np.zeros(disparity.shape, np.uint8)
            whole[:, low:] = confidence
            confidence = whole
        return Matched(disparity=disparity, confidence=confidence, report=found.report)


def _plan(last: _Last | None, shape: tuple[int, ...], searched: int) -> tuple[SearchedAs, Range | None]:
    """Say in which range to search, before the pair's images are asked; None: in full."""
    if last is None or last.shape != shape:
        return SearchedAs.FIRST, None
    if last.range is None:
        return SearchedAs.EMPTY, None
    if last.range.size_px > WIDE_SHARE * searched:
        return SearchedAs.WIDE, None
    if last.narrowed + 1 >= DUE_EVERY:
        return SearchedAs.DUE, None
    return SearchedAs.NARROWED, last.range


def range_of(disparity: Disparity, disparities: int, before: Range | None = None) -> Range | None:
    """Find the range in which to search after a pair.

    Args:
        disparity: of that pair, (H, W) float32, px, NaN = none.
        disparities: N, px: the full range is 0 <= d < N.
        before: the range of the pair before it; stays if it fits and is not much too large, so that one matcher serves many pairs.

    Returns:
        Where its values lie, but for TAIL_SHARE of the pixels at each end, with the margin; None if it has too few values.
    """
    valued = disparity.copy()
    cv2.patchNaNs(valued, -1.0)  # below the histogram, so not counted
    counts = np.asarray(cv2.calcHist([valued], [0], None, [disparities], [0, disparities])).reshape(-1)
    below = np.cumsum(counts.astype(np.int64))
    tail, found = math.ceil(disparity.size * TAIL_SHARE), int(below[-1])
    if found <= 2 * tail:
        return None
    low = max(int(np.searchsorted(below, tail, side="right")) - MARGIN_PX, 0)
    high = min(int(np.searchsorted(below, found - tail, side="left")) + 1 + MARGIN_PX, disparities)
    holds = before is not None and before.low_px <= low and high <= before.high_px
    if before is not None and holds and before.size_px - (high - low) < 2 * STEP_PX:
        return before
    missing = -(high - low) % STEP_PX  # goes to the near side, where things move faster
    return Range(low_px=low, high_px=min(high + missing, disparities))
