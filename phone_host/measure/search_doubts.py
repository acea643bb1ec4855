"""Judges whether the search could find the right disparity: wide enough, and only one answer. Pure. Figures: decision 0029."""

import math
from typing import Final

from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Evidence

_BEYOND_SHARE: Final = 0.05
_MOSTLY_BEYOND: Final = 0.5
"""Wrong matches put 1 % of the features beyond a search that is wide enough."""

_AMBIGUOUS_SHARE: Final = 0.75
"""Good pairs of scenes measure 0.2 at most, of chessboards before a wall 0.61; regular stripes and checks 0.9 and more."""

_PATTERN_SHARE: Final = 0.8
"""Given scenes with any mistake measure 0.41 at most, where depth was found at all."""

_HALF: Final = 0.5
_FEW: Final = 24
"""A fence before a wall: half of the patches repeat, and fewer features agree with anything. Chessboards have 80 and more."""


def is_pattern(evidence: Evidence) -> bool:
    """Tell whether so much of what the images show repeats that matched features prove nothing.

    Args:
        evidence: of the pair.
    """
    most = max((item.features for item in evidence.supports), default=0)
    return evidence.ambiguous_share > _PATTERN_SHARE or (evidence.ambiguous_share > _HALF and most < _FEW)


def too_short(evidence: Evidence) -> tuple[Concern, ...]:
    """Say how much of the scene is nearer than was searched; empty if hardly any.

    Args:
        evidence: of the pair.
    """
    share = evidence.beyond_share
    if not share > _BEYOND_SHARE:
        return ()
    remedy = f"give --disparities {evidence.enough_disparities}"
    if not math.isnan(evidence.enough_from_m):
        remedy = f"give --near {_rounded_down(evidence.enough_from_m)}m without --disparities, or --disparities {evidence.enough_disparities}"
    return (
        Concern(
            Doubt.SEARCH_TOO_SHORT,
            f"{share:.0%} of the scene is nearer than was searched, and what is nearer gets a wrong depth",
            remedy,
            is_severe=share > _MOSTLY_BEYOND,
        ),
    )


def _rounded_down(depth_m: float) -> str:
    """Write a depth with two digits, not farther than it is."""
    step = 10.0 ** (math.floor(math.log10(depth_m)) - 1)
    return f"{math.floor(depth_m / step + 1e-9) * step:.6g}"


def ambiguous(evidence: Evidence) -> tuple[Concern, ...]:
    """Say that the pattern repeats within the search; empty if it does not.

    Args:
        evidence: of the pair.
    """
    if not (evidence.ambiguous_share > _AMBIGUOUS_SHARE or is_pattern(evidence)):
        return ()
    return (
        Concern(
            Doubt.AMBIGUOUS,
            f"the pattern repeats: {evidence.ambiguous_share:.0%} of the places looked at fit elsewhere as well, and depth may be off by whole repeats",
            "show a scene with irregular texture, or put irregular things before the pattern",
        ),
    )
