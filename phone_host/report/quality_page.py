"""The page of `quality`: figures, maps of the image, plots over the distance; one self-contained HTML document. Pure."""

import math
from functools import partial
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.imagesize.head import size_text
from phone_host.report.page_frame import HALF_PX, document, section, table, two_widths
from phone_host.report.page_links import FileLink, files_section, list_section
from phone_host.report.quality_lines import COLUMNS, quality_row
from phone_host.report.quality_report import (
    MAPS_LEFT_OUT,
    MOST_MAPS,
    NO_TRUTH,
    MeasuredPair,
    QualityReport,
    bias_words,
    flaw,
    quality_verdict,
    signed,
)
from phone_host.report.report_page import Figure, Picture, figures_row, heading, picture_uri
from phone_host.report.stereo_report import FailedPair
from phone_host.svg.plot_maps import tile_map
from phone_host.svg.plot_marks import Curve, Mark, over_distance, span_m

_MEANINGS: Final = (
    ("plane-fit RMS", "how far depths lie off the fitted plane, along the optical axis (root mean square)"),
    ("sub-pixel RMS", "how far disparities lie off it, px: the matcher's noise, the same at all distances"),
    ("fill rate", "share of the region's pixels that have depth"),
    ("bias", "the plane's distance minus the true one, also called Z accuracy; above 0 is too far"),
    ("bend", "how much neighbours lie off the plane together; a plane has nearly none"),
    (
        "off the plane",
        "share of wrong matches: farther off than 1 px and than four standard deviations; no figure counts them",
    ),
)
_FITTED: Final = (
    "A plane in space is a plane in disparity (d = a x + b y + c), and there noise is the same everywhere, so the plane is"
    " fitted there."
)
_LEAST_OFFSET_MM, _LEAST_SCATTER_PX = 0.5, 0.1  # smaller differences are not worth strong colours


def quality_page(report: QualityReport) -> str:
    """Make the page: an HTML document."""
    verdict, sentence = quality_verdict(report)
    count = len(report.pairs)
    remarks = [remark.text for remark in report.remarks]
    if report.planes and not report.knows_truth:
        remarks.append(NO_TRUTH)
    if len(report.measured) > MOST_MAPS:
        remarks.append(MAPS_LEFT_OUT)
    for pair in report.measured:
        problem = flaw(pair.quality)
        remarks += [f"{pair.name}: {one.text}" for one in (*([problem] if problem else []), *pair.remarks)]
    parts = [
        heading("Depth quality", _subtitle(report), verdict, sentence),
        figures_row(_figures(report.planes[0])) if count == 1 and report.planes else "",
        list_section("Remarks", remarks),
        _all_pairs(report),
        _over_depth(report),
        *(_pair(pair, is_only=count == 1) for pair in report.measured[:MOST_MAPS]),
        section("What the figures mean", _FITTED, table(("figure", "meaning"), _MEANINGS)),
        files_section((FileLink("report.json", "all figures, with those of every tile"),)),
    ]
    return document("Depth quality", "".join(parts))


def _subtitle(report: QualityReport) -> str:
    if len(report.pairs) == 1:
        return f"{report.pairs[0].left}, {report.pairs[0].right}; matcher {report.matcher}"
    return f"{len(report.pairs)} pairs, {report.pairs[0].left} to {report.pairs[-1].left}; matcher {report.matcher}"


def _figures(pair: MeasuredPair) -> tuple[Figure, ...]:
    quality = pair.quality
    expected = ""
    if math.isfinite(pair.calibration_error_m):
        expected = f"the calibration leaves ± {pair.calibration_error_m * 1e3:.1f} mm to be expected"
    if math.isfinite(quality.bias_m):
        share, unit = signed(quality.bias_share * 100, 2), f"% = {signed(quality.bias_m * 1e3, 1)} mm"
    else:
        share, unit, expected = "\u2013", "", "the true distance is not known"
    return (
        Figure(label="plane-fit RMS", value=f"{quality.rms_m * 1e3:.2f}", unit=f"mm = {quality.rms_share:.2%}"),
        Figure(label="sub-pixel RMS", value=f"{quality.subpixel_rms_px:.3f}", unit="px"),
        Figure(label="fill rate", value=f"{quality.fill * 100:.1f}", unit="%"),
        Figure(label="bias (Z accuracy)", value=share, unit=unit, note=expected),
        Figure(label="distance", value=f"{quality.distance_m:.3f}", unit="m"),
        Figure(label="tilt", value=f"{quality.tilt_deg:.1f}", unit="°"),
    )


def _all_pairs(report: QualityReport) -> str:
    if len(report.pairs) == 1:
        return ""
    rows: list[tuple[str, ...]] = []
    for pair in report.pairs:
        if isinstance(pair, FailedPair):
            rows.append((pair.name, f"failed: {pair.failure.text}"))
        else:
            theory = f"{report.theory_m(pair.quality.distance_m) * 1e3:.2f} mm" if pair.is_plane else "\u2013"
            rows.append((*quality_row(pair), theory))
    return section("All pairs", "", table((*COLUMNS, "RMS by theory"), rows))


def _over_depth(report: QualityReport) -> str:
    """Make the card with RMS and bias over the distance."""
    if len(report.planes) < 2:
        return ""
    places_m = span_m(np.array([pair.quality.distance_m for pair in report.planes]))
    theory = Curve(places_m, np.array([report.theory_m(place) for place in places_m]) * 1e3)
    opposite = Curve(places_m, -theory.values)
    rms = [
        Mark(one.quality.distance_m, one.quality.rms_m * 1e3, f"{one.name}: {one.quality.rms_m * 1e3:.2f} mm")
        for one in report.planes
    ]
    bias = [
        Mark(one.quality.distance_m, one.quality.bias_m * 1e3, f"{one.name}: {bias_words(one.quality)}")
        for one in report.planes
    ]
    shown = _half("Plane-fit RMS", partial(over_distance, rms, [theory], "mm", "plane-fit RMS over the distance"))
    if report.knows_truth:
        shown += _half("Bias", partial(over_distance, bias, [theory, opposite], "mm", "bias over the distance"))
    words = (
        f"The line is theory, z² e / (f b), with e = {report.sigma_px:.3f} px, the pairs' median sub-pixel RMS: noise of"
        " matching grows with the square of the distance. RMS above the line: matching is worse there. Bias beyond it on one side: a"
        " wrong baseline, focal length, rectification or reference."
    )
    return section("Over the distance", words, f'<div class="pair">{shown}</div>')


def _half(title: str, draw: "partial[str]") -> str:
    return f"<div><h3>{escape(title)}</h3>{two_widths(lambda width: draw(width_px=width), HALF_PX)}</div>"


def _pair(pair: MeasuredPair, *, is_only: bool) -> str:
    """Make the card with a pair's maps."""
    quality, tiles = pair.quality, pair.quality.tiles
    against = "the true plane" if math.isfinite(quality.true_m) else "the fitted plane"
    maps = []
    if pair.picture:
        label = f"Distance of each disparity from the plane, px: red is too near, blue too far. The frame is the region that counts, {size_text((quality.roi.width_px, quality.roi.height_px))} px."
        picture = Picture(label, pair.picture)
        maps.append(f'<img alt="{escape(label)}" src="{picture_uri(picture)}"><figcaption>{escape(label)}</figcaption>')
        offset_mm = tiles.offset_m * 1e3
        maps.append(
            _tiles(offset_mm, _limit(offset_mm, _LEAST_OFFSET_MM), f"Depth minus {against}, mm.", two_sided=True)
        )
        scatter = tiles.scatter_px
        maps.append(
            _tiles(scatter, _limit(scatter, _LEAST_SCATTER_PX), "Scatter of the disparities of a tile, px RMS.")
        )
    maps.append(_tiles(tiles.fill * 100, 100.0, "Fill rate, %."))
    content = f'<div class="pictures">{"".join(f"<figure>{one}</figure>" for one in maps)}</div>'
    if is_only:
        return section("Over the image", _image_words(pair), content + _details(pair))
    return section(pair.name, "", f"<details><summary>Maps and figures</summary>{content}{_details(pair)}</details>")


def _image_words(pair: MeasuredPair) -> str:
    return (
        ""
        if not pair.picture
        else "Each number is that of a tile; a dash: nothing of the plane there. Values that grow towards the corners are the lens model's."
    )


def _tiles(values: NDArray[np.float64], limit: float, label: str, *, two_sided: bool = False) -> str:
    digits = 0 if limit >= 20 else 1 if limit >= 2 else 2
    drawn = tile_map(
        values,
        limit,
        label,
        lambda value: signed(value, digits) if two_sided else f"{value:.{digits}f}",
        two_sided=two_sided,
    )
    return f"{drawn}<figcaption>{escape(label)}</figcaption>"


def _limit(values: NDArray[np.float64], least: float) -> float:
    """Return the value with the strongest colour: the greatest, but for one tile in twenty."""
    known = np.abs(values[np.isfinite(values)])
    return max(least, float(np.percentile(known, 95))) if known.size else least


def _details(pair: MeasuredPair) -> str:
    quality = pair.quality
    rows = [("rectified size", f"{size_text(pair.rectified_px)} px"), ("fill rate", f"{quality.fill:.2%}")]
    if math.isfinite(quality.subpixel_rms_px):
        rows += [
            ("off the plane", f"{quality.off_plane:.2%}"),
            ("bend", f"{quality.bend_px:.3f} px"),
            ("shortest distance", f"{quality.perpendicular_m:.4f} m"),
            ("tilt", f"{quality.tilt_deg:.2f}°"),
            ("focal length, baseline", f"{pair.geometry.focal_px:.1f} px, {pair.geometry.baseline_m * 1e3:.2f} mm"),
        ]
    if math.isfinite(quality.true_m):
        rows.append(("true distance", f"{quality.true_m:.4f} m; bias {bias_words(quality)}"))
    if math.isfinite(pair.board_misfit_px):
        rows.append(("corners of the board", f"{pair.board_misfit_px:.3f} px RMS off its pose"))
    if math.isfinite(pair.corners_bias_share):
        rows.append(
            ("bias of its corners alone", f"{signed(pair.corners_bias_share * 100, 2)}%: the rig's, without matching")
        )
    return f"<details><summary>More figures</summary>{table(('figure', 'value'), rows)}</details>"
