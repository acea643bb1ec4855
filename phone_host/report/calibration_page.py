"""The page of `calibrate`: what the rig is good for, and what the views show; one self-contained HTML document. Pure."""

import math
from typing import Final, assert_never

import numpy as np

from common.imagesize.head import size_text
from common.words import counted
from phone_host.model import Verdict
from phone_host.model.calibration_series import CalibrationSeries, SeriesRig
from phone_host.report.calibration_figures import camera_tables, figures_card, millimetres
from phone_host.report.calibration_space import rig_card
from phone_host.report.calibration_views import (
    course_card,
    coverage_card,
    field_card,
    rectified_card,
    rejected_card,
    views_card,
)
from phone_host.report.page_frame import document
from phone_host.report.page_links import FileLink, files_section
from phone_host.report.report_page import Figure, Headline, figures_row, heading

_TITLE: Final = "Calibration"
_COLOURS: Final = {
    Verdict.GOOD: Headline.GOOD,
    Verdict.USABLE: Headline.WARNING,
    Verdict.REJECT: Headline.BAD,
}
_DEPTH_M: Final = 1.0


def calibration_page(series: CalibrationSeries) -> str:
    """Make the page: an HTML document."""
    found = series.found
    parts = [
        heading(_TITLE, _subtitle(series), _COLOURS[series.verdict], verdict_words(series)),
        "" if found is None else figures_row(_figures(series, found)),
        "" if found is None else figures_card(found),
        coverage_card(series),
        rectified_card(series),
        views_card(series),
        rejected_card(series),
        field_card(series),
        course_card(series),
        "" if found is None else rig_card(series, found),
        "" if found is None else camera_tables(found),
        files_section(_files(series)),
    ]
    return document(_TITLE, "".join(parts))


def verdict_words(series: CalibrationSeries) -> str:
    """Say what the rig is good for and, unless it is good, what to do."""
    because = f", {series.cause}" if series.cause else ""
    match series.verdict:
        case Verdict.GOOD:
            told = f" But mind: {_sentence(series.cause_words)}" if series.cause else ""
            return f"Good: scan with it.{told}"
        case Verdict.USABLE:
            return f"Usable{because}: {_sentence(series.remedy)}"
        case Verdict.REJECT:
            what = f"{series.problem}: {series.remedy}" if series.problem else series.remedy
            return f"Rejected{because}: {_sentence(what)}"
        case _:
            assert_never(series.verdict)


def _sentence(words: str) -> str:
    return f"{words.replace('+-', '±')}."


def _subtitle(series: CalibrationSeries) -> str:
    used = sum(view.is_used for view in series.views)
    left, right = (f"{size_text(size)} px" for size in series.sizes_px)
    sizes = left if left == right else f"left {left}, right {right}"
    return f"{used} of {counted(len(series.views), 'pair')} used; {series.board}; images {sizes}"


def _figures(series: CalibrationSeries, found: SeriesRig) -> tuple[Figure, ...]:
    baseline_mm = float(np.linalg.norm(found.rig.t_right_left_m)) * 1e3
    depths = dict(found.depths)
    figures = [
        Figure(
            label="pairs used",
            value=str(sum(view.is_used for view in series.views)),
            unit=f"of {len(series.views)}",
        )
    ]
    p95_px = float(np.percentile(found.vertical_px, 95))
    if math.isfinite(p95_px):
        note = f"good up to {found.limits.good_px:.2f} px"
        figures.append(Figure(label="vertical error, 95 %", value=f"{p95_px:.3f}", unit="px", note=note))
    figures.append(Figure(label="RMS of all corners", value=f"{found.rig.rms_stereo_px:.3f}", unit="px"))
    sigma = f"± {millimetres(found.baseline_sigma_m)} mm; " if math.isfinite(found.baseline_sigma_m) else ""
    measured = f"you measured {found.measured_m * 1e3:.1f} mm" if math.isfinite(found.measured_m) else ""
    note = f"{sigma}{measured or 'compare it with a ruler'}"
    figures.append(Figure(label="baseline", value=f"{baseline_mm:.2f}", unit="mm", note=note))
    sigma_m = depths.get(_DEPTH_M, math.nan)
    if math.isfinite(sigma_m):
        figures.append(
            Figure(
                label=f"depth at {_DEPTH_M:g} m",
                value=f"± {millimetres(sigma_m)}",
                unit="mm",
                note="by the calibration alone",
            )
        )
    if math.isfinite(found.square_mean_m):
        note = f"held out; true {found.square_m * 1e3:.2f} mm"
        figures.append(Figure(label="squares", value=f"{found.square_mean_m * 1e3:.2f}", unit="mm", note=note))
    return tuple(figures)


def _files(series: CalibrationSeries) -> tuple[FileLink, ...]:
    rig = () if not series.rig_file else (FileLink(series.rig_file, "the calibration, for run, stereo and measure"),)
    return (*rig, FileLink("report.json", "all figures"))
