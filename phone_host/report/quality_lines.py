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


def quality_lines(report: QualityReport, out: str, width: int = 0) -> list[str]:
    """Say what was measured.

    Args:
        report: all pairs.
        out: the results folder, as the user named it.
        width: of the terminal, characters; 0: no limit.
    """
    lines = [quality_verdict(report)[1], *_table([quality_row(pair) for pair in report.measured], width)]
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


def _table(rows: list[tuple[str, ...]], width: int) -> list[str]:
    """Return one line for each pair, or, where that is wider than the terminal, one for each value."""
    if not rows:
        return []
    rows = [COLUMNS, *rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(cell.ljust(wide) for cell, wide in zip(row, widths, strict=True)).rstrip() for row in rows]
    if not width or max(map(len, lines)) <= width:
        return lines
    label = max(map(len, COLUMNS)) + 2
    return [f"{title:{label}}{cell}" for row in rows[1:] for title, cell in zip(COLUMNS, row, strict=True)]


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
        return [f"{pair.name} failed: {pair.failure.text}"]
    problem = flaw(pair.quality)
    found = [*([problem] if problem else []), *pair.remarks]
    return [f"{'note' if remark.is_note else 'warning'}: {pair.name}: {remark.text}" for remark in found]
