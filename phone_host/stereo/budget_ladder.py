"""The ways in which pairs of one size can be matched, best first: what a time budget chooses from. Pure.

First the working size shrinks, because all of the scene keeps a depth, only a coarser one. Only at the smallest size the search
becomes narrower, because near objects get lost. The next matcher comes last.
"""

import math
from dataclasses import dataclass
from typing import Final

from phone_host.model import Search, StereoGeometry
from phone_host.stereo.matcher_names import AnyMatcher

_SCALES: Final = (1.0, 0.75, 0.6, 0.5, 0.42, 0.35, 0.3, 0.25)
"""Shares of the usual working size. Each step saves about a third of the pixels; a quarter of 640x480 is what toys had."""

_LEAST_SIDE_PX: Final = 60
"""Images are not made smaller than this: at 80x60 px a window of the matchers covers a tenth of the scene."""

_RANGES: Final = (0.75, 0.5)
"""Shares of the search. Half of it moves the nearest depth to twice the distance."""

_RANGE_STEP: Final = 16
"""Px: what vectors of 8-bit costs take at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetWanted:
    """A time budget for each pair.

    Attributes:
        budget_ns: from the beginning of decoding to the cloud, ns.
        matchers: that may be used, best first.
        may_scale: whether the working size may change.
        may_narrow: whether the search may become narrower.
    """

    budget_ns: int
    matchers: tuple[AnyMatcher, ...]
    may_scale: bool = True
    may_narrow: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """How a pair is matched, in place of what the core was built with.

    Attributes:
        matcher: the algorithm.
        scale: size of the images that are matched, as a share of the rectified ones', in (0, 1].
        disparities: N, px of the rectified images.
    """

    matcher: AnyMatcher
    scale: float
    disparities: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """What a core matches of pairs of one size if nothing is chosen.

    Attributes:
        width_px: of the part that is matched, px of the rectified images.
        height_px: the same.
        search: scale and range.
        geometry: of the rectified images; None without metres.
    """

    width_px: int
    height_px: int
    search: Search
    geometry: StereoGeometry | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A choice, and how much work it is.

    Attributes:
        choice: the choice.
        width_px: of the images that are matched, px.
        height_px: the same.
        full_pixels: pixels before they are reduced.
    """

    choice: Choice
    width_px: int
    height_px: int
    full_pixels: int

    @property
    def pixels(self) -> int:
        """Pixels of each image that is matched."""
        return self.width_px * self.height_px

    @property
    def searched(self) -> int:
        """Disparities that are searched, px of the matched images."""
        return max(1, math.ceil(self.choice.disparities * self.choice.scale))


def ladder(extent: Extent, wanted: BudgetWanted) -> tuple[Step, ...]:
    """List the ways to match, best first.

    Args:
        extent: what is matched without a budget; its range is known.
        wanted: what may change.

    Returns:
        At least one step for each matcher.
    """
    scale, widest = extent.search.scale, extent.search.disparities
    smallest = _LEAST_SIDE_PX / min(extent.width_px, extent.height_px)
    smaller = [scale * share for share in _SCALES[1:] if scale * share >= smallest] if wanted.may_scale else []
    narrower = [_rounded(widest * share) for share in _RANGES] if wanted.may_narrow else []
    ways = [(each, widest) for each in (scale, *smaller)]
    ways += [((scale, *smaller)[-1], each) for each in dict.fromkeys(narrower) if each < widest]
    return tuple(
        Step(
            choice=Choice(matcher=matcher, scale=each, disparities=disparities),
            width_px=max(1, round(extent.width_px * each)),
            height_px=max(1, round(extent.height_px * each)),
            full_pixels=extent.width_px * extent.height_px,
        )
        for matcher in wanted.matchers
        for each, disparities in ways
    )


def _rounded(disparities: float) -> int:
    return max(1, math.ceil(disparities / _RANGE_STEP)) * _RANGE_STEP
