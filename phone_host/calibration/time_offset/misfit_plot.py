"""Plots the misfit of each time offset as a standalone SVG file, which uPlot does not make. Pure: values in, text out."""

from html import escape
from typing import Final

import numpy as np

from phone_host.calibration.time_offset.shots import Measured
from phone_host.svg.plot_scale import Linear, number_text, span, ticks

_WIDTH_PX, _HEIGHT_PX = 720, 320
_LEFT_PX, _RIGHT_PX, _TOP_PX, _BOTTOM_PX = 60, 16, 40, 44
_STYLE: Final = (
    "text{font:12px system-ui,sans-serif;fill:#333}.grid{stroke:#ddd}.curve{stroke:#0072b2;stroke-width:1.5;fill:none}"
    ".found{stroke:#d55e00;stroke-width:1.5}.doubt{fill:#d55e00;fill-opacity:.15}"
)


def misfit_svg(measured: Measured) -> str:
    """Draw the misfit over the offset, with the answer and its uncertainty."""
    use = np.isfinite(measured.misfits)
    offsets_ms, misfits = measured.offsets_s[use] * 1e3, measured.misfits[use]
    first_ms, last_ms = span(offsets_ms)
    least, most = span(misfits)
    across = Linear(low=first_ms, high=last_ms, start_px=_LEFT_PX, end_px=_WIDTH_PX - _RIGHT_PX)
    up = Linear(low=least, high=most, start_px=_HEIGHT_PX - _BOTTOM_PX, end_px=_TOP_PX)
    found_ms, doubt_ms = measured.offset.offset_ns / 1e6, measured.offset.uncertainty_ns / 1e6
    parts = [f'<rect width="{_WIDTH_PX}" height="{_HEIGHT_PX}" fill="#fff"/>']
    for value in ticks(across.low, across.high, 8):
        x = across.px(value)
        parts.append(f'<path class="grid" d="M{x:.1f} {up.start_px}V{up.end_px}"/>')
        parts.append(f'<text x="{x:.1f}" y="{up.start_px + 18}" text-anchor="middle">{number_text(value)}</text>')
    for value in ticks(up.low, up.high, 5):
        y = up.px(value)
        parts.append(f'<path class="grid" d="M{across.start_px} {y:.1f}H{across.end_px}"/>')
        parts.append(f'<text x="{across.start_px - 6}" y="{y + 4:.1f}" text-anchor="end">{number_text(value)}</text>')
    low_px, high_px, here_px = (across.px(found_ms + way * doubt_ms) for way in (-1, 1, 0))
    parts.append(
        f'<rect class="doubt" x="{low_px:.1f}" y="{up.end_px}" width="{max(1.0, high_px - low_px):.1f}" height="{up.start_px - up.end_px}"/>'
    )
    parts.append(f'<path class="found" d="M{here_px:.1f} {up.start_px}V{up.end_px}"/>')
    points = " ".join(f"{across.px(x):.1f},{up.px(y):.1f}" for x, y in zip(offsets_ms, misfits, strict=True))
    parts.append(f'<polyline class="curve" points="{points}"/>')
    title = f"{measured.method.value}: host minus board {found_ms:+.2f} \u00b1 {doubt_ms:.2f} ms"
    parts.append(f'<text x="{_LEFT_PX}" y="18">{escape(title)}; {escape(measured.misfit)}</text>')
    parts.append(f'<text x="{_WIDTH_PX / 2}" y="{_HEIGHT_PX - 8}" text-anchor="middle">time offset, ms</text>')
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH_PX} {_HEIGHT_PX}" width="{_WIDTH_PX}" height="{_HEIGHT_PX}">'
    return f"{head}<style>{_STYLE}</style>{''.join(parts)}</svg>\n"
