"""Says why no pair has depth, and what helps: what became of the pixels tells. Pure."""

from typing import Final

from common.words import distance_text
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import CutCounts, DepthLimits

_ENOUGH: Final = 0.15
"""If fewer pixels than this share were matched and then cut, the pairs lack depth because their images do not match."""

_CAUSES: Final = frozenset({Doubt.SEARCH_TOO_SHORT, Doubt.DARK, Doubt.UNFOCUSED, Doubt.NO_TEXTURE})
"""Doubts that explain it."""

_UNMATCHED: Final = Concern(
    Doubt.NO_DEPTH,
    "no pair has depth",
    "check that --calibration or --rectified fits the cameras, and that both see the same scene",
)
_AT_ZERO: Final = Concern(
    Doubt.NO_DEPTH,
    "no pair has depth: all points are too far to measure",
    "move nearer or mount the cameras farther apart; check that --calibration or --rectified fits the cameras",
)


def no_depth(cut: CutCounts | None, limits: DepthLimits | None, others: tuple[Concern, ...] = ()) -> Concern:
    """Return the doubt about pairs of which no pixel has depth.

    Args:
        cut: what became of their pixels; None: not counted.
        limits: to which their clouds were cut; None without a cloud.
        others: the other doubts about them: one of them may say why.
    """
    cause = [concern for concern in others if concern.doubt in _CAUSES]
    if cause:
        return Concern(Doubt.NO_DEPTH, f"{_UNMATCHED.sentence}: {cause[0].sentence}", cause[0].remedy)
    return _UNMATCHED if cut is None else _by_cut(cut, limits)


def _by_cut(cut: CutCounts, limits: DepthLimits | None) -> Concern:
    """Say which limit cut the points, if it is that."""
    most = max(cut.at_zero, cut.too_far, cut.too_near)
    if most < _ENOUGH * cut.inside or not most:
        return _UNMATCHED
    if most == cut.at_zero or limits is None:
        return _AT_ZERO
    found = cut.at_zero + cut.too_far + cut.too_near
    who = "all points lie" if most == found else "most points lie"
    if most == cut.too_near:
        return Concern(
            Doubt.NO_DEPTH,
            f"no pair has depth: {who} nearer than --near {distance_text(limits.near_m)}",
            "give a smaller --near, or move away",
        )
    if limits.from_rig:
        return Concern(
            Doubt.NO_DEPTH,
            f"no pair has depth: {who} farther than {distance_text(limits.far_m)}, where these cameras measure too coarsely",
            "move nearer or mount the cameras farther apart; --far shows farther points all the same",
        )
    return Concern(
        Doubt.NO_DEPTH,
        f"no pair has depth: {who} farther than --far {distance_text(limits.far_m)}",
        "give a larger --far",
    )
