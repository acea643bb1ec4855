"""Plots the misfit of each time offset as a standalone SVG file. Pure: values in, text out."""

import numpy as np

from phone_host.calibration.time_offset.shots import Measured
from phone_host.svg.plot_parts import axes, frame, standalone, svg, ticks_below, wider

_SIZE_PX = (720, 320)


def misfit_svg(measured: Measured) -> str:
    """Draw the misfit over the offset, with the answer and its uncertainty."""
    use = np.isfinite(measured.misfits)
    offsets_ms, misfits = measured.offsets_s[use] * 1e3, measured.misfits[use]
    across, up = frame(_SIZE_PX, wider(offsets_ms, 0.02), wider(misfits, 0.05))
    found_ms, doubt_ms = measured.offset.offset_ns / 1e6, measured.offset.uncertainty_ns / 1e6
    low_px, high_px, here_px = (across.px(found_ms + way * doubt_ms) for way in (-1, 1, 0))
    doubt = (
        f'x="{low_px:.1f}" y="{up.end_px}" width="{max(1.0, high_px - low_px):.1f}" height="{up.start_px - up.end_px}"'
    )
    points = " ".join(f"{across.px(x):.1f},{up.px(y):.1f}" for x, y in zip(offsets_ms, misfits, strict=True))
    parts = [
        axes(_SIZE_PX, up, measured.misfit, "time offset, ms") + ticks_below(_SIZE_PX, across),
        f'<rect {doubt} style="fill:var(--c4);fill-opacity:.15"/>',
        f'<path style="stroke:var(--c4);stroke-width:1.5" d="M{here_px:.1f} {up.start_px}V{up.end_px}"/>',
        f'<polyline style="stroke:var(--c5);stroke-width:1.5;fill:none" points="{points}"/>',
    ]
    found = f"{measured.method.value}: host minus board {found_ms:+.2f} \u00b1 {doubt_ms:.2f} ms"
    return standalone(found, (), svg(*_SIZE_PX, "misfit of each time offset", parts))
