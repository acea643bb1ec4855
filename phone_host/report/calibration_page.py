"""The page of `calibrate`: what the rig is good for, and what the views show; one self-contained HTML document. Pure."""

import math
from typing import Final, assert_never

import numpy as np

from common.imagesize.head import size_text
from common.words import counted
from phone_host.model import Verdict
from phone_host.model.calibration_session import CalibrationSession, SessionRig
from phone_host.report.calibration_figures import camera_tables, figures_card
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


def calibration_page(session: CalibrationSession) -> str:
    """Make the page.

    Args:
        session: what it shows.

    Returns:
        An HTML document.
    """
    found = session.found
    parts = [
        heading(_TITLE, _subtitle(session), _COLOURS[session.verdict], verdict_words(session)),
        "" if found is None else figures_row(_figures(session, found)),
        "" if found is None else figures_card(found),
        coverage_card(session),
        rectified_card(session),
        views_card(session),
        rejected_card(session),
        field_card(session),
        course_card(session),
        "" if found is None else rig_card(session, found),
        "" if found is None else camera_tables(found),
        files_section(_files(session)),
    ]
    return document(_TITLE, "".join(parts))


def verdict_words(session: CalibrationSession) -> str:
    """Say what the rig is good for and, unless it is good, what to do."""
    because = f", {session.cause}" if session.cause else ""
    match session.verdict:
        case Verdict.GOOD:
            told = f" But mind: {_sentence(session.cause_words)}" if session.cause else ""
            return f"Good: scan with it.{told}"
        case Verdict.USABLE:
            return f"Usable{because}: {_sentence(session.remedy)}"
        case Verdict.REJECT:
            what = f"{session.problem}: {session.remedy}" if session.problem else session.remedy
            return f"Rejected{because}: {_sentence(what)}"
        case _:
            assert_never(session.verdict)


def _sentence(words: str) -> str:
    return f"{words.replace('+-', '±')}."


def _subtitle(session: CalibrationSession) -> str:
    used = sum(view.is_used for view in session.views)
    left, right = (f"{size_text(size)} px" for size in session.sizes_px)
    sizes = left if left == right else f"left {left}, right {right}"
    return f"{used} of {counted(len(session.views), 'pair')} used; {session.board}; images {sizes}"


def _figures(session: CalibrationSession, found: SessionRig) -> tuple[Figure, ...]:
    baseline_mm = float(np.linalg.norm(found.rig.t_right_left_m)) * 1e3
    depths = dict(found.depths)
    figures = [
        Figure(
            label="pairs used",
            value=str(sum(view.is_used for view in session.views)),
            unit=f"of {len(session.views)}",
        )
    ]
    p95_px = float(np.percentile(found.vertical_px, 95))
    if math.isfinite(p95_px):
        note = f"good up to {found.limits.good_px:.2f} px"
        figures.append(Figure(label="vertical error, 95 %", value=f"{p95_px:.3f}", unit="px", note=note))
    figures.append(Figure(label="RMS of all corners", value=f"{found.rig.rms_stereo_px:.3f}", unit="px"))
    sigma = f"± {found.baseline_sigma_m * 1e3:.2g} mm; " if math.isfinite(found.baseline_sigma_m) else ""
    note = f"{sigma}compare it with a ruler"
    figures.append(Figure(label="baseline", value=f"{baseline_mm:.2f}", unit="mm", note=note))
    sigma_m = depths.get(_DEPTH_M, math.nan)
    if math.isfinite(sigma_m):
        figures.append(
            Figure(
                label=f"depth at {_DEPTH_M:g} m",
                value=f"± {sigma_m * 1e3:.2g}",
                unit="mm",
                note="by the calibration alone",
            )
        )
    if math.isfinite(found.square_mean_m):
        note = f"held out; true {found.square_m * 1e3:.2f} mm"
        figures.append(Figure(label="squares", value=f"{found.square_mean_m * 1e3:.2f}", unit="mm", note=note))
    return tuple(figures)


def _files(session: CalibrationSession) -> tuple[FileLink, ...]:
    rig = () if not session.rig_file else (FileLink(session.rig_file, "the calibration, for run, stereo and measure"),)
    return (*rig, FileLink("report.json", "all figures"))
