"""Says what became of a left image's pixels: how many have a point, and why the others have none. Pure."""

import math

from common.words import distance_text
from phone_host.model import CutCounts, DepthLimits, Search, StereoGeometry


def cut_rows(cut: CutCounts, limits: DepthLimits | None) -> tuple[tuple[str, int], ...]:
    """List what became of the pixels, in words, those with a point first; zeros are left out.

    Args:
        cut: the counts.
        limits: between which depths points were kept; None: none.
    """
    far = f"farther than {distance_text(limits.far_m)}" if limits is not None else "too far"
    near = f"nearer than {distance_text(limits.near_m)}" if limits is not None and limits.near_m > 0 else "too near"
    rows = (
        ("have a point", cut.kept),
        ("found no match", cut.unmatched),
        ("are too far to measure", cut.at_zero),
        (far, cut.too_far),
        (near, cut.too_near),
        ("outside the crop", cut.outside),
    )
    return tuple((words, count) for words, count in rows if count)


def cut_sentence(cut: CutCounts, limits: DepthLimits | None) -> str:
    """Say in one line what was cut: `12 % farther than 38 m, 3 % nearer than 300 mm`; empty if nothing was.

    Args:
        cut: the counts.
        limits: between which depths points were kept; None: none.
    """
    total = sum(count for _, count in cut_rows(cut, limits))
    kept = {"have a point", "found no match"}
    return ", ".join(
        f"{share_text(count, total)} {words}" for words, count in cut_rows(cut, limits) if words not in kept
    )


def share_text(count: int, total: int) -> str:
    """Write a share in percent; a small one is never called 0 %."""
    percent = 100.0 * count / max(1, total)
    if percent < 0.1:
        return "< 0.1 %" if count else "0 %"
    return f"{percent:.1f} %" if percent < 10.0 else f"{percent:.0f} %"


def searched_from_m(geometry: StereoGeometry | None, search: Search | None) -> float:
    """Return the depth from which a pair was searched, m: that of the largest disparity, N - 1; NaN: not known.

    Args:
        geometry: of the rectified pair; None: not known.
        search: how it was matched; None: not known.
    """
    if geometry is None or search is None or not search.disparities:
        return math.nan
    largest_px = search.disparities - 1 + geometry.doffs_px
    return geometry.focal_px * geometry.baseline_m / largest_px if largest_px > 0 else math.nan
