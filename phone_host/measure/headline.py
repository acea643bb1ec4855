"""Answers the user's question in one sentence: is my depth right, and how far can I trust it? Pure."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from phone_host.measure.depth_error import depth_error_m
from phone_host.measure.image_doubts import ImageFigures
from phone_host.measure.run_snapshot import RunSnapshot, concerns
from phone_host.measure.trust import Concern
from phone_host.model import StereoGeometry

USUAL_ERROR_PX: Final = 0.25
"""A matcher's median error on real images (`tests/bench/bench_depth.py`), where the core states none."""


class Grade(Enum):
    """How good the answer is; its values are those of the page's headline."""

    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer.

    Attributes:
        grade: good, warning or bad.
        sentence: one sentence, or two with a remedy.
    """

    grade: Grade
    sentence: str


def answer(
    figures: ImageFigures, found: tuple[Concern, ...], geometry: StereoGeometry | None, error_px: float = math.nan
) -> Answer:
    """Answer for depth that was computed.

    Args:
        figures: what the images say.
        found: the concerns, gravest first.
        geometry: converts disparity to metres; None if it is not known.
        error_px: error of a disparity, px; NaN: the usual one.
    """
    if found:
        grade = Grade.BAD if found[0].doubt.blocks else Grade.WARNING
        opening = "Depth is wrong" if grade is Grade.BAD else "Depth may be wrong"
        return Answer(grade, f"{opening}: {found[0].sentence}. Remedy: {found[0].remedy}.")
    if math.isnan(figures.density):
        return Answer(Grade.GOOD, "Depth was computed; no pair of this run was judged.")
    parts = [f"{figures.density:.0%} of the pixels have depth"]
    if not math.isnan(figures.vertical_px):
        parts.append(f"rows agree to {max(figures.vertical_px, 0.1):.1f} px")
    text = f"Depth looks right: {', '.join(parts)}; "
    return Answer(Grade.GOOD, text + _reach(figures, geometry, USUAL_ERROR_PX if math.isnan(error_px) else error_px))


def _reach(figures: ImageFigures, geometry: StereoGeometry | None, error_px: float) -> str:
    """Say how good the depth is in the middle of the scene: at its median disparity."""
    if geometry is None:
        return "it is in pixels only, because focal length and baseline are not known."
    shifted_px = figures.disparity_px + geometry.doffs_px
    depth_m = geometry.focal_px * geometry.baseline_m / shifted_px if shifted_px > 0 else 1.0
    error_mm = depth_error_m(geometry, depth_m, error_px) * 1e3
    shown = (
        f"{error_mm:.0f} mm"
        if 1 <= error_mm < 1000
        else metres(error_mm / 1e3)
        if error_mm >= 1
        else f"{error_mm:.1f} mm"
    )
    return f"at {metres(depth_m)}, the middle of the scene, it is good to about {shown}."


def metres(depth_m: float) -> str:
    """Write a depth with two digits, such as 0.85 m, 2.6 m or 38 m."""
    rounded = float(f"{depth_m:.2g}")
    return f"{rounded:.0f} m" if rounded >= 10 else f"{rounded:.2g} m"


def headline(run: RunSnapshot) -> Answer:
    """Answer for a run.

    Args:
        run: the run.
    """
    if not run.processed:
        if run.spoiled_images:
            return Answer(Grade.BAD, "No pair had two whole images: check the cameras.")
        return Answer(Grade.BAD, "No pair was processed: no frames of the two cameras came together.")
    found = concerns(run)
    if run.images.wants_depth:
        return answer(run.images.now, found, run.images.geometry, run.images.disparity_error_px)
    if found:
        sentence = f"{found[0].sentence[:1].upper()}{found[0].sentence[1:]}. Remedy: {found[0].remedy}."
        return Answer(Grade.WARNING, sentence)
    return Answer(Grade.GOOD, "This run measured pairs and delays only, no depth: no calibration was given.")
