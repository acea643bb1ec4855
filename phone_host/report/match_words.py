"""Tells what a matcher corrected: to programs, and in plain words where it was enough to matter. Pure."""

from typing import Any, Final

from phone_host.model import Epipolar, MatchReport

_TOLD_PX: Final = 0.25
"""From this vertical error on, matching without the correction would be measurably worse."""

_TOLD_SHARE: Final = 0.1
"""A difference of a tenth in brightness or contrast is what an eye sees when it looks from one image to the other."""

_MIDDLE: Final = 128.0
"""Grey level at which brightness is told."""


def corrected_values(report: MatchReport | None) -> dict[str, Any] | None:
    """Make the object `corrected` of report.json; None if nothing is known.

    Args:
        report: what was corrected.
    """
    if report is None:
        return None
    counts = report.confidence_histogram
    return {
        "vertical_px": round(report.vertical_px, 3),
        "gain": round(report.gain, 4),
        "offset_levels": round(report.offset_levels, 2),
        "confidence_histogram": None if counts is None else list(counts),
    }


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
    parts = [*_place(report.vertical_px, epipolar), *_levels(report)]
    if not parts:
        return ""
    both = {1: "this was", 2: "both were"}.get(len(parts), "all of this was")
    listed = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
    return f"the right image {listed}; {both} corrected before matching"


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
