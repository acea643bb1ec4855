"""report.json of `stereo`: its keys are the fields of these classes. Pure.

One pair's object is the same whether it was computed alone or as one of several.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.model import CutCounts, DepthLimits, StereoGeometry
from phone_host.report.drift_report import StillsDrift
from phone_host.report.json_result import D3, D4, D5, FieldOf, json_values, made
from phone_host.report.match_words import Corrected
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import ALWAYS, FailedPair, PairReport, SetReport, pair_verdict, set_verdict
from phone_host.report.stereo_trust import Trust

_pair, _failed, _set = FieldOf[PairReport](), FieldOf[FailedPair](), FieldOf[SetReport]()


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFile:
    """An image, and its size."""

    file: str
    size: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PairResult:
    """What came of a pair."""

    format_version: int = REPORT_FORMAT
    command: str = "stereo"
    verdict: Headline = _pair(lambda pair: pair_verdict(pair)[0])
    headline: str = _pair(lambda pair: pair_verdict(pair)[1])
    left: ImageFile = _pair(lambda pair: ImageFile(file=pair.left, size=size_text(pair.left_px)))
    right: ImageFile = _pair(lambda pair: ImageFile(file=pair.right, size=size_text(pair.right_px)))
    size: str = _pair(lambda pair: size_text(pair.rectified_px))
    matcher: str
    disparities: int | None = _pair(lambda pair: pair.search.disparities or None if pair.search else None)
    searched_from_m: D4 | None
    scale: D4 | None = _pair(lambda pair: pair.search.scale if pair.search else None)
    corrected: Corrected | None = _pair(lambda pair: made(Corrected, pair.match_report))
    geometry: StereoGeometry | None
    limits: DepthLimits | None
    cut: CutCounts | None
    density: D5
    points: int | None = _pair(lambda pair: pair.written.points)
    unit: str | None = _pair(lambda pair: "metre" if pair.written.points is not None else None)
    axes: str | None = _pair(lambda pair: pair.axes.text if pair.written.points is not None else None)
    not_in_depth_png: int = _pair(lambda pair: pair.written.not_in_depth_png)
    trust: Trust = _pair(lambda pair: made(Trust, pair.trust))
    warnings: tuple[str, ...] = _pair(lambda pair: tuple(remark.text for remark in pair.remarks))
    times_ms: Mapping[str, D3] = _pair(lambda pair: dict(pair.stages_ms))
    files: tuple[str, ...] = _pair(lambda pair: (*pair.written.files, *ALWAYS))


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedEntry:
    """A pair that could not be computed."""

    name: str
    left: str
    right: str
    problem: str = _failed(lambda pair: pair.failure.message)
    remedy: str = _failed(lambda pair: pair.failure.remedy)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairEntry:
    """One of several pairs; its folder's report.json has the rest."""

    name: str
    left: str
    right: str
    verdict: Headline = _pair(lambda pair: pair_verdict(pair)[0])
    density: D5
    points: int | None = _pair(lambda pair: pair.written.points)
    warnings: tuple[str, ...] = _pair(lambda pair: tuple(remark.text for remark in pair.remarks))
    files: tuple[str, ...] = _pair(lambda pair: (*pair.written.files, *ALWAYS))


@dataclass(frozen=True, slots=True, kw_only=True)
class SetResult:
    """What came of several pairs."""

    format_version: int = REPORT_FORMAT
    command: str = "stereo"
    verdict: Headline = _set(lambda report: set_verdict(report)[0])
    headline: str = _set(lambda report: set_verdict(report)[1])
    paired_by: str = _set(lambda each: "number" if each.by_number else "name" if each.by_name else "name order")
    left_alone: tuple[str, ...]
    right_alone: tuple[str, ...]
    interrupted_of: int | None = _set(lambda report: report.interrupted_of or None)
    computed: int = _set(lambda report: len(report.computed))
    failed: int = _set(lambda report: len(report.failed))
    drift: StillsDrift | None = _set(lambda report: made(StillsDrift, report.drift))
    warnings: tuple[str, ...] = _set(lambda report: tuple(remark.text for remark in report.remarks))
    pairs: tuple[PairEntry | FailedEntry, ...] = _set(
        lambda report: tuple(made(FailedEntry if isinstance(p, FailedPair) else PairEntry, p) for p in report.pairs)
    )
    files: tuple[str, ...] = _set(lambda report: (*(pair.name for pair in report.computed), *ALWAYS))


def pair_json(report: PairReport) -> dict[str, Any]:
    """Make the object of report.json for one pair."""
    return json_values(made(PairResult, report))


def set_json(report: SetReport) -> dict[str, Any]:
    """Make the object of report.json for several pairs."""
    return json_values(made(SetResult, report))
