"""The page of `scan`: whether there is a model, the model to turn, how well each pair fits it; one self-contained HTML document. Pure."""

import math
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from common.imagesize.head import size_text
from common.words import counted, distance_text, two_digits
from phone_host.model import UnseenSurface
from phone_host.output.axes import Axes
from phone_host.report.model_view import ShownModel, model_view
from phone_host.report.page_frame import document, section, table, two_widths
from phone_host.report.page_links import FileLink, NextCommand, files_section, list_section, next_section
from phone_host.report.page_script import Script
from phone_host.report.report_page import Figure, figures_row, heading
from phone_host.report.scan_lines import area_text, mat_line
from phone_host.report.scan_report import (
    MODEL,
    TRAJECTORY,
    ModelFigures,
    ScanReport,
    scan_verdict,
    share_text,
    unseen_words,
)
from phone_host.scan.scanned import ScannedPair
from phone_host.svg.plot_marks import Course, over_views
from phone_host.svg.plot_parts import legend

_FITS: Final = (
    "Each pair is aligned to the model made from the earlier pairs. The mean distance of its depths from the model shows how well they"
    " agree; an error that all pairs share, such as a wrong baseline, does not show."
)
_SHARES: Final = (
    "Depth: the pixels that the matcher could measure. On the model: the share of these on surface that earlier pairs have measured. A pair below 15 %"
    " is rejected, and one below 35 % if few corners agree on its motion."
)


def scan_page(report: ScanReport, shown: ShownModel, commands: tuple[NextCommand, ...] = ()) -> str:
    """Make the page: an HTML document."""
    verdict, sentence = scan_verdict(report)
    view = model_view(shown, MODEL)
    remarks = [
        *(stretch.sentence for stretch in report.stretches),
        *(f"{pair.name} failed: {pair.failure.text}" for pair in report.failed),
        *(remark.text for remark in report.remarks),
    ]
    files = (
        FileLink(MODEL, f"the surface with its colours, metres; {_axes_words(report.axes)}"),
        FileLink(
            TRAJECTORY,
            "camera poses, one line for each pair whose pose is known: s, m, quaternion x y z w (TUM's format)",
        ),
        FileLink("report.json", "all figures, with those of every pair"),
    )
    parts = [
        heading("Scan", _subtitle(report), verdict, sentence),
        figures_row(_figures(report)),
        section("Model", "", view) if view else "",
        list_section("Remarks", remarks),
        next_section((), commands),
        _on_mat(report),
        _fits(report),
        files_section(files),
    ]
    runs = (Script.DEPTH,) if view else (Script.COPY,) if commands else ()
    return document("Scan", "".join(parts), *runs)


def _subtitle(report: ScanReport) -> str:
    names = [pair.name for pair in report.pairs]
    which = f"{counted(len(names), 'pair')}, {names[0]} to {names[-1]}" if names else "no pairs"
    return f"{which}; {size_text(report.rectified_px)} px, matcher {report.matcher}"


def _axes_words(axes: Axes) -> str:
    return axes.text if axes.is_upright else f"{axes.text} at the first pair"


def _known(model: ModelFigures) -> tuple[Figure, ...]:
    if not math.isfinite(model.noise_m):  # of no surface that was seen
        return ()
    return (
        Figure(
            label="expected surface error",
            value=f"\u00b1{two_digits(model.noise_m * 1e3)}",
            unit="mm",
            note=f"median; 95 % of the points: \u00b1{two_digits(model.noise_p95_m * 1e3)} mm ({model.error_scope.value})",
        ),
    )


def _figures(report: ScanReport) -> tuple[Figure, ...]:
    model, settings = report.model, report.settings
    if settings is None or not model.triangles:
        return ()
    area, unit = area_text(model.size.area_m2).split(" ")
    width, height, depth = (f"{length * 1e3:.0f}" for length in model.size.extent_m)
    return (
        Figure(label="pairs in the model", value=f"{report.fused}", unit=f"of {len(report.pairs)}"),
        *_known(model),
        *_off(report.off_m),
        Figure(label="surface", value=area, unit=unit, note=f"{width} x {height} x {depth} mm"),
        _border(model, report.unseen),
        Figure(
            label="voxels",
            value=f"{settings.voxel_m * 1e3:.3g}",
            unit="mm",
            note=f"depths to {distance_text(settings.far_m)}, {model.memory_bytes / 1e6:.0f} MB",
        ),
    )


def _off(off_m: float) -> tuple[Figure, ...]:
    """Show how far the depths of a pair lie off the model; a mat tells where a pair was taken, and nothing is compared then."""
    if not math.isfinite(off_m):
        return ()
    return (
        Figure(
            label="distance of pairs from the model",
            value=two_digits(off_m * 1e3),
            unit="mm",
            note="mean; median of the pairs",
        ),
    )


def _on_mat(report: ScanReport) -> str:
    """Show what the mat told: its corners in each pair."""
    told, pairs = report.on_mat, report.scanned
    if told is None or len(pairs) < 2:
        return ""
    courses = tuple(
        Course(
            label,
            colour,
            np.array([math.nan if pair.mat is None else pair.mat.seen[side] for pair in pairs]),
            np.zeros(len(pairs)),
        )
        for side, (label, colour) in enumerate((("left image", 0), ("right image", 2)))
    )
    names = [pair.name for pair in pairs]
    return section(
        "The mat",
        f"{mat_line(told).capitalize()}; by its name, {told.square_m * 1e3:g} mm.",
        legend([(one.label, one.colour) for one in courses])
        + two_widths(partial(over_views, names, courses, "corners", "corners of the mat that each pair shows")),
    )


def _border(model: ModelFigures, unseen: UnseenSurface) -> Figure:
    """Tell what nobody saw: how much of a closed surface, or where an open one ends."""
    if math.isfinite(model.unseen_share):
        share, unit = share_text(model.unseen_share).split(" ")
        return Figure(label="never in view", value=share, unit=unit, note=f"of the surface; it {unseen_words(unseen)}")
    border, unit = distance_text(model.size.border_m).split(" ")
    note = "length of the edges where the surface ends; 0 is closed"
    return Figure(label="open border", value=border, unit=unit, note=note)


def _fits(report: ScanReport) -> str:
    pairs = report.scanned
    if len(pairs) < 2 or report.mat is not None:
        return ""
    names = [pair.name for pair in pairs]

    def course(label: str, colour: int, value: Callable[[ScannedPair], float]) -> Course:
        return Course(label, colour, np.array([value(pair) for pair in pairs]), np.zeros(len(pairs)))

    off = (
        course("off the model", 5, lambda pair: pair.off_m * 1e3 if pair.is_fused else math.nan),
        course("not in the model", 4, lambda pair: math.nan if pair.is_fused else pair.off_m * 1e3),
    )
    shares = (
        course("depth", 0, lambda pair: pair.density * 100),
        course("on the model", 2, lambda pair: pair.overlap * 100),
    )
    rows = [(one.label, one.colour) for one in off]
    return section(
        "How well the pairs fit",
        _FITS,
        legend(rows)
        + two_widths(partial(over_views, names, off, "mm", "distance of each pair's depths from the model")),
    ) + section(
        "What the pairs show",
        _SHARES,
        legend([(one.label, one.colour) for one in shares])
        + two_widths(partial(over_views, names, shares, "%", "depth and share on the model of each pair"))
        + table(
            ("camera", "figure"),
            (
                ("went", distance_text(report.path_m)),
                ("from first to last place", distance_text(_reach_m(report))),
            ),
        ),
    )


def _reach_m(report: ScanReport) -> float:
    places = [pair.world_camera.t_m for pair in report.scanned if pair.is_fused]
    return float(np.linalg.norm(places[-1] - places[0])) if places else 0.0
