"""report.json of `scan`. Pure."""

import math
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.report.scan_report import ScanReport, scan_verdict
from phone_host.report.stereo_report import FailedPair
from phone_host.scan.scan import ScannedPair


def scan_json(report: ScanReport) -> dict[str, Any]:
    """Make the object of report.json. Lengths are metres, shares 0 to 1; null: not measured. It holds no times: equal pairs give equal bytes."""
    verdict, sentence = scan_verdict(report)
    model, settings, geometry = report.model, report.settings, report.geometry
    return {
        "format_version": REPORT_FORMAT,
        "command": "scan",
        "verdict": verdict.value,
        "headline": sentence,
        "matcher": report.matcher,
        "size": size_text(report.rectified_px),
        "focal_px": geometry.focal_px if geometry else None,
        "baseline_m": geometry.baseline_m if geometry else None,
        "in_model": report.fused,
        "interrupted_of": report.interrupted_of or None,
        "path_m": round(report.path_m, 6),
        "off_model_m": _number(report.off_m),
        "model": {
            "axes": report.axes.text,
            "points": model.points,
            "triangles": model.triangles,
            "area_m2": round(model.size.area_m2, 6),
            "border_m": round(model.size.border_m, 6),
            "extent_m": [round(length, 6) for length in model.size.extent_m],
            "noise_m": _number(model.noise_m),
            "noise_p95_m": _number(model.noise_p95_m),
            "voxel_m": settings.voxel_m if settings else None,
            "far_m": round(settings.far_m, 6) if settings else None,
            "memory_bytes": model.memory_bytes,
            "blocks_left_out": model.left_out,
        },
        "warnings": [remark.text for remark in report.remarks],
        "pairs": [_pair(pair) for pair in report.pairs],
        "files": list(report.files),
    }


def _pair(pair: ScannedPair | FailedPair) -> dict[str, Any]:
    if isinstance(pair, FailedPair):
        return {"name": pair.name, "problem": pair.problem, "remedy": pair.remedy}
    return {
        "name": pair.name,
        "stamp_s": pair.stamp_s,
        "state": pair.state.value,
        "weakness": pair.weakness.value,
        "density": round(pair.density, 4),
        "corners": pair.corners,
        "overlap": _number(pair.overlap),
        "off_m": _number(pair.off_m),
        "place_m": [round(value, 6) for value in pair.world_camera.t_m.tolist()],
    }


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
