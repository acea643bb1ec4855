"""report.json of `scan`. Pure."""

import math
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.output.json_text import json_number
from phone_host.report.scan_report import ScanReport, scan_verdict
from phone_host.report.stereo_report import FailedPair
from phone_host.scan.scanned import PoseOrigin, ScannedPair
from phone_host.scan.surface_error import ErrorScope


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
        "off_model_m": json_number(report.off_m),
        "mat": _mat(report),
        "model": {
            "axes": report.axes.text,
            "points": model.points,
            "triangles": model.triangles,
            "area_m2": round(model.size.area_m2, 6),
            "border_m": round(model.size.border_m, 6),
            "extent_m": [round(length, 6) for length in model.size.extent_m],
            "noise_m": json_number(model.noise_m),
            "noise_p95_m": json_number(model.noise_p95_m),
            "drift_included": model.error_scope is ErrorScope.DRIFT if math.isfinite(model.noise_m) else None,
            "unseen_share": json_number(model.unseen_share),
            "unseen": report.unseen.value,
            "voxel_m": settings.voxel_m if settings else None,
            "far_m": round(settings.far_m, 6) if settings else None,
            "memory_bytes": model.memory_bytes,
            "blocks_left_out": model.left_out,
        },
        "warnings": [remark.text for remark in report.remarks],
        "pairs": [_pair(pair) for pair in report.pairs],
        "files": list(report.files),
    }


def _mat(report: ScanReport) -> dict[str, Any] | None:
    mat = report.on_mat
    if mat is None:
        return None
    return {
        "name": mat.name,
        "pairs": mat.pairs,
        "corners": mat.corners,
        "seen_left": mat.seen[0],
        "seen_right": mat.seen[1],
        "sigma_m": json_number(mat.sigma_m),
        "square_m": mat.square_m,
        "measured_m": json_number(mat.measured_m),
        "measured_sigma_m": json_number(mat.measured_sigma_m),
        "to_scale": mat.is_to_scale,
    }


def _pair(pair: ScannedPair | FailedPair) -> dict[str, Any]:
    if isinstance(pair, FailedPair):
        return {"name": pair.name, "problem": pair.failure.message, "remedy": pair.failure.remedy}
    return {
        "name": pair.name,
        "stamp_s": pair.stamp_s,
        "state": pair.state.value,
        "pose": pair.pose_origin.value,
        "weakness": pair.weakness.value,
        "density": round(pair.density, 4),
        "corners": pair.corners,
        "overlap": json_number(pair.overlap),
        "off_m": json_number(pair.off_m),
        "mat": None
        if pair.mat is None
        else {
            "left": pair.mat.seen[0],
            "right": pair.mat.seen[1],
            "rms_px": json_number(pair.mat.rms_px),
            "sigma_m": json_number(pair.mat.sigma_m),
        },
        "place_m": None
        if pair.pose_origin is PoseOrigin.NONE
        else [round(value, 6) for value in pair.world_camera.t_m.tolist()],
    }
