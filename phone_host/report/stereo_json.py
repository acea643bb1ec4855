"""report.json of `stereo`. Pure.

One pair's object is the same whether it was computed alone or as one of several.
"""

from dataclasses import asdict
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.output.json_text import json_number
from phone_host.report.drift_report import stills_drift_values
from phone_host.report.match_words import corrected_values
from phone_host.report.stereo_report import ALWAYS, FailedPair, PairReport, SetReport, pair_verdict, set_verdict
from phone_host.report.stereo_trust import trust_values


def pair_json(report: PairReport) -> dict[str, Any]:
    """Make the object of report.json for one pair."""
    search, written = report.search, report.written
    verdict, sentence = pair_verdict(report)
    return {
        "format_version": REPORT_FORMAT,
        "command": "stereo",
        "verdict": verdict.value,
        "headline": sentence,
        "left": {"file": report.left, "size": size_text(report.left_px)},
        "right": {"file": report.right, "size": size_text(report.right_px)},
        "size": size_text(report.rectified_px),
        "matcher": report.matcher,
        "disparities": search.disparities or None if search else None,
        "searched_from_m": json_number(report.searched_from_m, 4),
        "scale": round(search.scale, 4) if search else None,
        "corrected": corrected_values(report.match_report),
        "geometry": None if report.geometry is None else asdict(report.geometry),
        "limits": None if report.limits is None else asdict(report.limits),
        "cut": None if report.cut is None else asdict(report.cut),
        "density": round(report.density, 5),
        "points": written.points,
        "unit": "metre" if written.points is not None else None,
        "axes": report.axes.text if written.points is not None else None,
        "not_in_depth_png": written.not_in_depth_png,
        "trust": trust_values(report.trust),
        "warnings": [remark.text for remark in report.remarks],
        "times_ms": {stage: round(ms, 3) for stage, ms in report.stages_ms},
        "files": [*written.files, *ALWAYS],
    }


def set_json(report: SetReport) -> dict[str, Any]:
    """Make the object of report.json for several pairs."""
    verdict, sentence = set_verdict(report)
    return {
        "format_version": REPORT_FORMAT,
        "command": "stereo",
        "verdict": verdict.value,
        "headline": sentence,
        "paired_by": "number" if report.by_number else "name" if report.by_name else "name order",
        "left_alone": list(report.left_alone),
        "right_alone": list(report.right_alone),
        "interrupted_of": report.interrupted_of or None,
        "computed": len(report.computed),
        "failed": len(report.failed),
        "drift": stills_drift_values(report.drift),
        "warnings": [remark.text for remark in report.remarks],
        "pairs": [_entry(pair) for pair in report.pairs],
        "files": [*(pair.name for pair in report.computed), *ALWAYS],
    }


def _entry(pair: PairReport | FailedPair) -> dict[str, Any]:
    """Make the object of one of several pairs; its folder's report.json has the rest."""
    both = {"name": pair.name, "left": pair.left, "right": pair.right}
    if isinstance(pair, FailedPair):
        return {**both, "problem": pair.failure.message, "remedy": pair.failure.remedy}
    return {
        **both,
        "verdict": pair_verdict(pair)[0].value,
        "density": round(pair.density, 5),
        "points": pair.written.points,
        "warnings": [remark.text for remark in pair.remarks],
        "files": [*pair.written.files, *ALWAYS],
    }
