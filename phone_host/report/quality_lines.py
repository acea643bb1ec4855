"""What `quality` says on a terminal: one sentence, a short table, what is wrong. Pure."""

import math
from typing import Final

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
from phone_host.report.stereo_report import FailedPair

COLUMNS: Final = ("pair", "distance", "plane-fit RMS", "sub-pixel", "fill", "bias (Z accuracy)")
_LONGEST_NAME: Final = 24

_NO_RIG: Final = 0.2
"""A calibrated rig whose corners are off by more was not calibrated with this board: its squares are of another size."""


def quality_lines(report: QualityReport, out: str) -> list[str]:
    """Say what was measured.

    Args:
        report: all pairs.
        out: the results folder, as the user named it.
    """
    rows = [COLUMNS, *(quality_row(pair) for pair in report.measured)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
    lines = [quality_verdict(report)[1]]
    if report.measured:
        lines += [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
        ]
    for pair in report.pairs:
        lines += _remarks(pair)
    lines += [remark.line for remark in report.remarks]
    corners = [pair.corners_bias_share for pair in report.planes if math.isfinite(pair.corners_bias_share)]
    if corners:
        mean = sum(corners) / len(corners)
        whose = "that is the rig's, the rest is that of matching"
        if abs(mean) > _NO_RIG:
            whose = "no rig is that wrong: check --square"
        lines.append(f"note: the corners alone have a bias of {signed(100 * mean, 2)}%: {whose}")
    if report.planes and not report.knows_truth:
        lines.append(f"note: {NO_TRUTH}")
    if len(report.measured) > MOST_MAPS:
        lines.append(f"note: {MAPS_LEFT_OUT}")
    return [*lines, f"written to {out}: report.json, index.html"]


def quality_row(pair: MeasuredPair) -> tuple[str, ...]:
    """Return a pair's row for the table."""
    quality = pair.quality
    name = pair.name if len(pair.name) <= _LONGEST_NAME else f"{pair.name[: _LONGEST_NAME - 1]}\u2026"
    if not pair.is_plane:
        return name, "no plane", "\u2013", "\u2013", f"{quality.fill:.1%}", "\u2013"
    return (
        name,
        f"{quality.distance_m:.3f} m",
        f"{quality.rms_m * 1e3:.2f} mm ({quality.rms_share:.2%})",
        f"{quality.subpixel_rms_px:.3f} px",
        f"{quality.fill:.1%}",
        bias_words(quality),
    )


def _remarks(pair: MeasuredPair | FailedPair) -> list[str]:
    if isinstance(pair, FailedPair):
        return [f"{pair.name} failed: {pair.problem}: {pair.remedy}"]
    problem = flaw(pair.quality)
    found = [*([problem] if problem else []), *pair.remarks]
    return [f"{'note' if remark.is_note else 'warning'}: {pair.name}: {remark.text}" for remark in found]
