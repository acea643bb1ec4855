"""report.json of `quality`. Pure."""

from typing import Any

from numpy.typing import NDArray

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.model import Crop
from phone_host.report.quality_report import MeasuredPair, QualityReport, flaw, quality_verdict
from phone_host.report.stereo_report import ALWAYS, FailedPair

_TILE_DIGITS = 5


def quality_json(report: QualityReport) -> dict[str, Any]:
    """Make the object of report.json. Lengths are metres, shares 0 to 1; null: not measured."""
    verdict, sentence = quality_verdict(report)
    planes = report.planes
    return {
        "format_version": REPORT_FORMAT,
        "command": "quality",
        "verdict": verdict.value,
        "headline": sentence,
        "matcher": report.matcher,
        "planes": len(planes),
        "interrupted_of": report.interrupted_of or None,
        "sigma_px": report.sigma_px,
        "focal_px": planes[0].geometry.focal_px if planes else None,
        "baseline_m": planes[0].geometry.baseline_m if planes else None,
        "left_alone": list(report.left_alone),
        "right_alone": list(report.right_alone),
        "warnings": [remark.text for remark in report.remarks],
        "pairs": [_pair(report, pair) for pair in report.pairs],
        "files": list(ALWAYS),
    }


def _pair(report: QualityReport, pair: MeasuredPair | FailedPair) -> dict[str, Any]:
    both = {"name": pair.name, "left": pair.left, "right": pair.right}
    if isinstance(pair, FailedPair):
        return {**both, "problem": pair.failure.message, "remedy": pair.failure.remedy}
    quality, problem, tiles = pair.quality, flaw(pair.quality), pair.quality.tiles
    return {
        **both,
        "size": size_text(pair.rectified_px),
        "seen": quality.seen.value,
        "problem": problem.message if problem else None,
        "remedy": problem.remedy if problem else None,
        "roi": _rectangle(quality.roi),
        "pixels": quality.pixels,
        "fill": quality.fill,
        "off_plane": quality.off_plane,
        "plane_rms_m": quality.rms_m,
        "plane_rms_share": quality.rms_share,
        "subpixel_rms_px": quality.subpixel_rms_px,
        "bend_px": quality.bend_px,
        "distance_m": quality.distance_m,
        "perpendicular_m": quality.perpendicular_m,
        "tilt_deg": quality.tilt_deg,
        "true_m": quality.true_m,
        "bias_m": quality.bias_m,
        "bias_share": quality.bias_share,
        "calibration_error_m": pair.calibration_error_m,
        "board_misfit_px": pair.board_misfit_px,
        "corners_bias_share": pair.corners_bias_share,
        "theory_rms_m": report.theory_m(quality.distance_m),
        "tiles": {
            "area": _rectangle(tiles.area),
            "fill": _grid(tiles.fill),
            "scatter_px": _grid(tiles.scatter_px),
            "offset_px": _grid(tiles.offset_px),
            "offset_m": _grid(tiles.offset_m),
            "offset_share": _grid(tiles.offset_share),
        },
        "warnings": [remark.text for remark in pair.remarks],
    }


def _rectangle(area: Crop) -> list[int]:
    return [area.x_px, area.y_px, area.width_px, area.height_px]


def _grid(values: NDArray[Any]) -> list[list[float]]:
    return [[round(float(value), _TILE_DIGITS) for value in row] for row in values]
