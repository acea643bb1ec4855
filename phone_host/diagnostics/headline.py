"""Answers the user's question in one sentence: is my depth right, and how far can I trust it? Pure."""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.image_judge import past, past_seconds
from phone_host.diagnostics.image_rules import ImageFigures, figure_doubts
from phone_host.diagnostics.run_rules import GONE, concerns, history
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.diagnostics.throughput import narrowed_words
from phone_host.model import CutCounts, StereoGeometry


def depth_error_m(geometry: StereoGeometry, depth_m: float, error_px: float) -> float:
    """Compute how wrong a depth is, m: |dz/dd| e = z^2 e / (f b), the derivative of z = f b / (d + doffs).

    Args:
        geometry: of the rectified pair.
        depth_m: the depth, m.
        error_px: error of its disparity, px.
    """
    return depth_m * depth_m * error_px / (geometry.focal_px * geometry.baseline_m)


_PATCHY: Final = 0.6
"""Scenes with texture reach 0.68 and more; boards and a guitar before bare walls 0.36 to 0.58, and specks stand on the walls."""

_SPECKS: Final = 0.09
"""Scenes with texture have up to 6 % of their depth in specks; boards before bare walls 7 to 20 %, a striped wall 21 %."""

_ROWS_GOOD_PX: Final = 1.0
"""Given pairs have 0.1 to 0.8 px. The matcher corrects a common offset of up to 2 px."""

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
    figures: ImageFigures,
    found: tuple[Diagnostic, ...],
    geometry: StereoGeometry | None,
    error_px: float = math.nan,
    cut: CutCounts | None = None,
) -> Answer:
    """Answer for depth that was computed.

    Args:
        figures: what the images say.
        found: the concerns, gravest first.
        geometry: converts disparity to metres; None if it is not known.
        error_px: error of a disparity, px; NaN: the usual one.
        cut: what became of the pixels; None: not counted.
    """
    if found:
        return _doubtful(found[0])
    if math.isnan(figures.density):
        return Answer(Grade.GOOD, "Depth was computed; no pair of this run was judged.")
    patchy = figures.consistency < _PATCHY or figures.scattered_share > _SPECKS
    parts = [f"{figures.density:.0%} {pixels_text(cut)} have depth"]
    checked = not math.isnan(figures.vertical_px)
    if figures.scattered_share > _SPECKS:
        parts.append(f"{figures.scattered_share:.0%} of it in specks that may be wrong")
    if figures.consistency < _PATCHY:
        parts.append(f"of which {figures.consistency:.0%} are confirmed from right to left")
    if checked:
        only = "only " if figures.vertical_px * figures.matched_scale > _ROWS_GOOD_PX else ""
        parts.append(f"rows agree {only}to {max(figures.vertical_px, 0.1):.1f} px")
    opening = "Depth looks right where the scene has texture, specks elsewhere" if patchy else "Depth looks right"
    if not checked:
        opening = "Depth could not be checked, too few features"
    reach = _reach(figures, geometry, USUAL_ERROR_PX if math.isnan(error_px) else error_px)
    return Answer(Grade.GOOD if checked else Grade.WARNING, f"{opening}: {', '.join(parts)}; {reach}")


def pixels_text(cut: CutCounts | None) -> str:
    """Say of which pixels a density is the share: `of the pixels`, `of the pixels inside the crop`."""
    return "of the pixels inside the crop" if cut is not None and cut.outside else "of the pixels"


def _doubtful(concern: Diagnostic) -> Answer:
    opening = "Depth is wrong" if concern.is_failure else "Depth may be wrong"
    grade = Grade.BAD if concern.is_failure else Grade.WARNING
    return Answer(grade, f"{opening}: {concern.message}. Remedy: {concern.remedy}.")


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
    """Answer for a run."""
    if not run.processed:
        return Answer(Grade.BAD, _without_pairs(run))
    if run.failure is not None:
        until = replace(run, failure=None)
        return Answer(
            Grade.BAD, f"The run broke off: {run.failure.sentences} Until then: {_lower(headline(until).sentence)}"
        )
    found = concerns(run)
    if run.images.wants_depth:
        gone = [concern for concern in found if concern.code in GONE]
        of_depth = (concern for concern in found if concern.code not in GONE and not concern.is_note)
        said = _with_range(_with_age(_with_lone(_of_images(run, tuple(of_depth)), found), found), run)
        return said if not gone or said.grade is Grade.BAD else _while_it_was_there(gone[0], said)
    if found:
        sentence = f"{_capital(found[0].message)}. Remedy: {found[0].remedy}."
        return Answer(Grade.WARNING, sentence)
    return Answer(Grade.GOOD, "This run measured pairs and delays only, no depth: no calibration was given.")


def _with_lone(said: Answer, found: tuple[Diagnostic, ...]) -> Answer:
    """Add to good news which images have no partner of their number."""
    lone = [item.message for item in found if item.code == Code.IMAGE_NUMBERS and item.is_note]
    if said.grade is not Grade.GOOD or not lone:
        return said
    return Answer(said.grade, f"{said.sentence} {_capital(lone[0])}.")


def _with_age(said: Answer, found: tuple[Diagnostic, ...]) -> Answer:
    """Warn instead of good news if the results are too old: the depth is right, but not where things are by now."""
    old = next((item.message for item in found if item.code == Code.AGE), "")
    if said.grade is not Grade.GOOD or not old:
        return said
    return Answer(Grade.WARNING, f"{said.sentence} But {old}.")


def _with_range(said: Answer, run: RunSnapshot) -> Answer:
    """Add that near things are not looked for, if a time budget has narrowed the search."""
    narrowed = narrowed_words(run.budget)
    return replace(said, sentence=f"{said.sentence} {_capital(narrowed)}, to hold --budget.") if narrowed else said


def _without_pairs(run: RunSnapshot) -> str:
    """Say why there is no pair: the error that ended the run knows best, then what the pairs that failed had."""
    if run.failure is not None:
        return f"No pair was processed: {run.failure.sentences}"
    if run.spoiled_images:
        return "No pair had two whole images: check the cameras."
    if run.failed_pairs:
        return f"No pair was processed: {run.failed_pairs[0][0].sentences}"
    if not run.link.sessions:
        absent = Diagnostic("no board came", "start board-agent on the board", Severity.FAIL)
        return f"No pair was processed: {(run.refused or absent).sentences}"
    return "No pair was processed: no frames of the two cameras came together."


def _of_images(run: RunSnapshot, found: tuple[Diagnostic, ...]) -> Answer:
    """Answer for the depth of a run, if the two cameras were always there."""
    images, newest = run.images, run.images.newest
    if images.judged and not images.is_settled and run.ended == "running":
        why = newest[0].message if newest else f"the newest pair is free of this: {images.concerns[0].message}"
        return Answer(Grade.WARNING, f"Depth is being judged again: {why}.")
    said = answer(
        images.now, found or figure_doubts(images.now), images.geometry, images.disparity_error_px, run.depth.cut
    )
    if said.grade is not Grade.GOOD:
        return said
    if newest:
        remedy = f"Remedy: {newest[0].remedy}."
        return Answer(Grade.WARNING, f"Depth looked right until the last judged pair: {newest[0].message}. {remedy}")
    if gone := past(history(run)):
        total_s = past_seconds(history(run))
        but = f"but for {_seconds(total_s)} of {_seconds(max(total_s, run.seconds))} s it was not: {gone[0].concern.message}"
        return Answer(Grade.WARNING, f"{said.sentence.removesuffix('.')}; {but}.")
    return said


def _while_it_was_there(gone: Diagnostic, said: Answer) -> Answer:
    """Put an absence before what can be said of the depth until then."""
    sentence = f"{_capital(gone.message)}. Remedy: {gone.remedy}. Until then: {_lower(said.sentence)}"
    return Answer(Grade.WARNING, sentence)


def _seconds(value_s: float) -> str:
    return f"{value_s:.0f}" if value_s >= 10 else f"{value_s:.1f}"


def _lower(words: str) -> str:
    return f"{words[:1].lower()}{words[1:]}"


def _capital(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}"
