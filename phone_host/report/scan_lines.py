"""What `scan` says on a terminal: first whether there is a model, then its figures, then what went wrong where. Pure."""

import math
from typing import Final

from common.imagesize.head import size_text
from common.words import counted, distance_text, two_digits
from phone_host.report.scan_report import MatFigures, ScanReport, scan_verdict

_MOST_LINES: Final = 8


def scan_lines(report: ScanReport, out: str) -> list[str]:
    """Say what came of a scan."""
    lines = [scan_verdict(report)[1]]
    model, settings = report.model, report.settings
    if settings is not None and model.triangles:
        width, height, depth = (distance_text(length) for length in model.size.extent_m)
        lines += [
            f"{size_text(report.rectified_px)} px, {report.matcher}; voxels of {distance_text(settings.voxel_m)}, depths to {distance_text(settings.far_m)}",
            f"{counted(model.triangles, 'triangle')}, {area_text(model.size.area_m2)}, {width} x {height} x {depth}; the camera went {distance_text(report.path_m)}",
        ]
        if math.isfinite(report.off_m):
            lines.append(f"a pair's depths lie {distance_text(report.off_m)} off the model (mean; median of the pairs)")
    if report.on_mat is not None:
        lines.append(mat_line(report.on_mat))
    told = [f"note: {stretch.sentence}" for stretch in report.stretches]
    lines += told[:_MOST_LINES]
    if len(told) > _MOST_LINES:
        lines.append(
            f"note: {counted(len(told) - _MOST_LINES, 'further stretch', 'further stretches')}: see report.json"
        )
    lines += [f"warning: {pair.name} failed: {pair.failure.text}" for pair in report.failed[:_MOST_LINES]]
    lines += [remark.line for remark in report.remarks]
    return [*lines, f"written to {out}: {', '.join(report.files)}"]


def mat_line(mat: MatFigures) -> str:
    """Say what a mat told."""
    left, right = (f"{count:.0f}" for count in mat.seen)
    square = f"{mat.measured_m * 1e3:.2f} \u00b1 {mat.measured_sigma_m * 1e3:.2f} mm"
    return (
        f"the mat is seen in {counted(mat.pairs, 'pair')}, {left} and {right} of its {mat.corners} corners (median); poses are known to"
        f" \u00b1 {two_digits(mat.sigma_m * 1e3)} mm; its squares measure {square}"
    )


def area_text(area_m2: float) -> str:
    """Write an area with about three digits: `1.25 m²`, `320 cm²`."""
    return f"{area_m2:.3g} m\u00b2" if area_m2 >= 0.1 else f"{area_m2 * 1e4:.3g} cm\u00b2"
