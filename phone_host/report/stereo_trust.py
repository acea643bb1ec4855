"""How far the depth of one pair of image files can be trusted, and how report.json tells of doubts and images. Pure."""

from dataclasses import dataclass

from common.diagnostic import Diagnostic
from phone_host.diagnostics.headline import Answer, Grade
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.report.json_result import FieldOf, Number, made


@dataclass(frozen=True, slots=True)
class PairTrust:
    """How far the depth of one pair can be trusted."""

    figures: ImageFigures
    concerns: tuple[Diagnostic, ...]
    answer: Answer


_doubt, _figures, _trust = FieldOf[Diagnostic](), FieldOf[ImageFigures](), FieldOf[PairTrust]()


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """Why a result may be wrong; if it blocks, it cannot be right."""

    doubt: str = _doubt(lambda each: each.code)
    sentence: str = _doubt(lambda each: each.message)
    remedy: str
    blocking: bool = _doubt(lambda each: each.is_failure)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImagesResult:
    """What the images say: shares, px."""

    density: Number
    consistency: Number
    scattered: Number = _figures(lambda figures: figures.scattered_share)
    vertical_error_px: Number = _figures(lambda figures: figures.vertical_px)
    vertical_offset_px: Number


@dataclass(frozen=True, slots=True, kw_only=True)
class Trust:
    """How far the depth of a pair can be trusted; shares, px."""

    grade: Grade = _trust(lambda trust: trust.answer.grade)
    headline: str = _trust(lambda trust: trust.answer.sentence)
    doubts: tuple[Doubt, ...] = _trust(lambda trust: made(Doubt, trust.concerns))
    density: Number = _trust(lambda trust: trust.figures.density)
    consistency: Number = _trust(lambda trust: trust.figures.consistency)
    scattered: Number = _trust(lambda trust: trust.figures.scattered_share)
    vertical_error_px: Number = _trust(lambda trust: trust.figures.vertical_px)
    vertical_offset_px: Number = _trust(lambda trust: trust.figures.vertical_offset_px)
