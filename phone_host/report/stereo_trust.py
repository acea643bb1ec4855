"""How far the depth of one pair of image files can be trusted. Pure."""

from dataclasses import dataclass

from common.diagnostic import Diagnostic
from phone_host.diagnostics.headline import Answer
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.report.run_json import concern_values, figure_values


@dataclass(frozen=True, slots=True)
class PairTrust:
    """How far the depth of one pair can be trusted."""

    figures: ImageFigures
    concerns: tuple[Diagnostic, ...]
    answer: Answer


def trust_values(trust: PairTrust) -> dict[str, object]:
    """Return the `trust` block of report.json."""
    return {
        "grade": trust.answer.grade.value,
        "headline": trust.answer.sentence,
        "doubts": [concern_values(concern) for concern in trust.concerns],
        **figure_values(trust.figures),
    }
