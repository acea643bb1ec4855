"""Judges one processed pair of images from files: its doubts, and the answer to whether its depth is right."""

from dataclasses import dataclass

from phone_host.measure.headline import Answer, answer
from phone_host.measure.image_doubts import ImageFigures, gravest_first, image_doubts, median_figures
from phone_host.measure.trust import NO_DEPTH, Concern
from phone_host.model import Processed
from phone_host.report.run_json import concern_values, figure_values
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import has_depth, maps_of, measure_evidence


@dataclass(frozen=True, slots=True)
class PairTrust:
    """How far the depth of one pair can be trusted.

    Attributes:
        figures: density, left-right consistency and vertical error.
        concerns: the doubts, gravest first.
        answer: the headline.
    """

    figures: ImageFigures
    concerns: tuple[Concern, ...]
    answer: Answer

    @property
    def is_wrong(self) -> bool:
        """Whether the depth cannot be right, or there is none: the command then ends with exit 4."""
        return any(concern.doubt.blocks for concern in self.concerns)


def judge_pair(core: StereoCore, processed: Processed) -> PairTrust:
    """Judge one pair.

    Args:
        core: the core that processed it.
        processed: its result.
    """
    evidence = measure_evidence(processed, maps_of(core, processed))
    found = image_doubts(evidence)
    if not has_depth(processed) and not any(concern.doubt.blocks for concern in found):
        found = gravest_first((NO_DEPTH, *found))
    figures = median_figures((evidence,))
    error_px = float("nan") if processed.limits is None else processed.limits.disparity_error_px
    return PairTrust(figures, found, answer(figures, found, core.geometry, error_px))


def trust_values(trust: PairTrust) -> dict[str, object]:
    """Return the `trust` block of report.json.

    Args:
        trust: of the pair.
    """
    return {
        "grade": trust.answer.grade.value,
        "headline": trust.answer.sentence,
        "doubts": [concern_values(concern) for concern in trust.concerns],
        **figure_values(trust.figures),
    }
