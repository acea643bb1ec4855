"""Says what became of a left image's pixels, how many have a point and why the others have none, and what a matcher corrected: to programs, and in plain words. Pure."""

import math
from dataclasses import dataclass
from typing import Final

from common.words import distance_text
from phone_host.model import CutCounts, DepthLimits, Epipolar, MatchReport, Search, StereoGeometry
from phone_host.report.json_result import D2, D3, D4

_TOLD_PX: Final = 0.25
"""From this vertical error on, matching without the correction would be measurably worse."""

_TOLD_SHARE: Final = 0.1
"""A difference of a tenth in brightness or contrast is what an eye sees when it looks from one image to the other."""

_SEEN_PX, _SEEN_GAIN, _SEEN_LEVELS, _SEEN_PERCENT = 0.005, 0.005, 0.5, 0.5
"""Less is 0 in the figures of a run."""

_MIDDLE: Final = 128.0
"""Grey level at which brightness is told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Corrected:
    """What a matcher corrected before, for report.json."""

    vertical_px: D3
    gain: D4
    offset_levels: D2
    vignetting_percent: D2
    shading_percent: D2
    confidence_histogram: tuple[int, ...] | None


def corrected_words(report: MatchReport | None, epipolar: Epipolar = Epipolar.LEFT) -> str:
    """Say how the right image differed and that this was corrected.

    Args:
        report: what was corrected.
        epipolar: which way the pair's epipolar lines run.

    Returns:
        One sentence without a full stop; empty if nothing worth telling was corrected.
    """
    if report is None:
        return ""
    parts = [*_place(report.vertical_px, epipolar), *_levels(report), *_evenness(report)]
    if not parts:
        return ""
    both = {1: "this was", 2: "both were"}.get(len(parts), "all of this was")
    listed = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
    return f"the right image {listed}; {both} corrected before matching"


def run_corrected_words(report: MatchReport | None, epipolar: Epipolar = Epipolar.LEFT) -> str:
    """Say in one line what was corrected over a run, figures included that are too small for `corrected_words`.

    Args:
        report: medians over the run; None: the matcher tells nothing.
        epipolar: which way the pairs' epipolar lines run.

    Returns:
        One line; empty if the matcher tells nothing.
    """
    if report is None:
        return ""
    parts = []
    if abs(report.vertical_px) >= _SEEN_PX:
        where = "sideways" if epipolar.is_vertical else "up" if report.vertical_px > 0 else "down"
        parts.append(f"moved {where} by {abs(report.vertical_px):.2f} px")
    if abs(report.gain - 1) >= _SEEN_GAIN or abs(report.offset_levels) >= _SEEN_LEVELS:
        parts.append(f"levels x {report.gain:.2f} {report.offset_levels:+.1f}")
    if abs(report.vignetting_percent) >= _SEEN_PERCENT:
        parts.append(f"corners another {report.vignetting_percent:+.0f}%")
    if report.shading_percent >= _SEEN_PERCENT:
        parts.append(f"one side {report.shading_percent:.0f}% more than the other")
    return f"corrected before matching, right image (medians): {', '.join(parts) or 'nothing'}"


def _place(vertical_px: float, epipolar: Epipolar) -> list[str]:
    if abs(vertical_px) < _TOLD_PX:
        return []
    if epipolar.is_vertical:
        return [f"lay {abs(vertical_px):.1f} px off to one side"]
    return [f"lay {abs(vertical_px):.1f} px too {'low' if vertical_px > 0 else 'high'}"]


def _levels(report: MatchReport) -> list[str]:
    """Tell the levels before the correction: left = gain * right + offset."""
    if report.gain <= 0:
        return []
    brightness = (_MIDDLE - report.offset_levels) / (report.gain * _MIDDLE) - 1
    contrast = 1 / report.gain - 1
    parts = []
    if abs(brightness) >= _TOLD_SHARE:
        parts.append(f"was {abs(brightness):.0%} {'brighter' if brightness > 0 else 'darker'}")
    if abs(contrast) >= _TOLD_SHARE and abs(contrast - brightness) >= _TOLD_SHARE:
        parts.append(f"had {abs(contrast):.0%} {'more' if contrast > 0 else 'less'} contrast")
    return parts


def _evenness(report: MatchReport) -> list[str]:
    """Tell where the right image was darker than elsewhere, before the correction."""
    corners = 1 / max(1 + report.vignetting_percent / 100, 0.1) - 1
    parts = []
    if abs(corners) >= _TOLD_SHARE:
        parts.append(f"was {abs(corners):.0%} {'brighter' if corners > 0 else 'darker'} at its corners")
    if report.shading_percent >= 100 * _TOLD_SHARE:
        parts.append(f"was {report.shading_percent:.0f}% darker at one side than at the other")
    return parts


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
