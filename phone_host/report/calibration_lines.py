"""The summary of phone-host calibrate: what came of the pictures, as lines of text."""

import math
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError
from common.orientation import UPRIGHT
from common.words import counted
from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.verdict import SHARE_GOOD, Calibration
from phone_host.calibration.target.board_views import BoardViews, turn_text
from phone_host.calibration.target.pairs import Rejected
from phone_host.model import Verdict
from phone_host.output.report_owner import REPORT
from phone_host.report.calibration_report import CalibrationReport, Judged
from phone_host.stereo.view_files import ViewFiles, is_unread_photograph

REFUSED: Final = "run and stereo refuse this calibration unless --use-rejected-rig is given"
_SHOWN = 3
_WHOLE_METRES = 10.0
"""From here on a limit in tenths of a metre says nothing."""


def earlier_words(name: str) -> str:
    """Say what the earlier rig is called now, behind a sentence on the new one that was written; empty if it was not moved."""
    return f"; the earlier one is now {name}" if name else ""


def rejections(rejected: tuple[Rejected, ...]) -> list[str]:
    """Return one line per pair that is not used."""
    return [f"{each.name:>8}  rejected: {each.reason.value} ({each.detail})" for each in rejected]


def passed_over_notes(files: tuple[Path, ...]) -> list[str]:
    """Warn of files that lie among the pictures and are not read."""
    if not files:
        return []
    shown = ", ".join(path.name for path in files[:_SHOWN]) + (", ..." if files[_SHOWN:] else "")
    remedy = ": convert them to JPEG" if any(is_unread_photograph(path) for path in files) else ""
    what = "1 file among the pictures is" if len(files) == 1 else f"{len(files)} files among the pictures are"
    return [f"warning  {what} not read ({shown}){remedy}"]


def pairing_notes(files: ViewFiles) -> list[str]:
    """Warn if the pairs were guessed from the order of names though the counts differ."""
    if files.by_number or files.by_name or not (files.left_alone or files.right_alone):
        return []
    left, right = (len(files.pairs) + len(alone) for alone in (files.left_alone, files.right_alone))
    counts = f"{left} left and {counted(right, 'right picture')}"
    return [f"warning  {counts} were paired in the order of their names, because the names share no numbers"]


def summary(report: CalibrationReport, out: Path) -> list[str]:
    """Return the report as lines of text.

    Args:
        report: what came of the pictures.
        out: the rig's file.
    """
    result = report.result
    if isinstance(result, DataError):
        return [*rejections(report.rejected), *_unwritten(report, out)]
    found = result.found
    rows = _view_rows(found, report.rejected)
    rows.append(f"{counted(len(found.used), 'pair')} used, {len(report.rejected)} rejected")
    rows += _turn_rows(report.views)
    rows += _figure_rows(result)
    rows.append(f"verdict  {report.verdict.value}")
    if not report.remedy and result.finding is not None:
        rows.append(f"note     {result.cause_words}")
    rows += [f"remedy   {report.remedy}"] if report.remedy else []
    return [*rows, *(_unwritten(report, out) if found.rectification is None else _written(report, out))]


def _view_rows(found: Calibration, rejected: tuple[Rejected, ...]) -> list[str]:
    known = found.obstacle is None  # a rig that cannot be rectified has no vertical errors
    rows = [f"{'pair':>8}  {'left px':>8} {'right px':>8}" + (f" {'vertical px':>11}" if known else "")]
    rows += [
        f"{u.name:>8}  {u.left_px:8.3f} {u.right_px:8.3f}" + (f" {u.vertical_px:11.3f}" if known else "")
        for u in found.used
    ]
    return rows + rejections(rejected)


def _turn_rows(views: BoardViews) -> list[str]:
    return [
        f"EXIF     {side} images are {turn_text(turn)}"
        for side, turn in zip(("left", "right"), views.turned, strict=True)
        if turn != UPRIGHT
    ]


def baseline_words(result: Judged) -> str:
    """Say how the baseline agrees with what the user measured; or ask to measure it."""
    if not math.isfinite(result.measured_m):
        return "compare it with a ruler"
    off = float(np.linalg.norm(result.found.rig.t_right_left_m)) / result.measured_m - 1
    return f"{off:+.1%} against the {result.measured_m * 1e3:.1f} mm that you measured"


def _figure_rows(result: Judged) -> list[str]:
    found, rig = result.found, result.found.rig
    rows = [f"RMS      left {rig.rms_left_px:.3f}, right {rig.rms_right_px:.3f}, stereo {rig.rms_stereo_px:.3f} px"]
    if found.obstacle is None:
        px = found.vertical_px
        rows.append(f"vertical mean {px.mean():.3f}, 95 % {np.percentile(px, 95):.3f}, max {px.max():.3f} px")
    rows.append(_baseline_row(float(np.linalg.norm(rig.t_right_left_m)) * 1e3, found.baseline_sigma_m))
    if found.obstacle is None:
        rows.append(
            f"         {baseline_words(result)}{'' if math.isfinite(result.measured_m) else ': it shows a wrong --square'}"
        )
    rows += _lens_rows(found)
    errors = ", ".join(
        f"{_sigma_mm(sigma_m)} mm at {depth_m:g} m" for depth_m, sigma_m in found.depths if math.isfinite(sigma_m)
    )
    if errors:
        rows.append(f"depth    +- {errors} by the calibration alone")
    squares = found.squares
    if squares.count:
        rows.append(
            f"squares  {squares.mean_m * 1e3:.2f} +- {_sigma_mm(squares.sigma_m)} mm on boards that were held out, {squares.true_m * 1e3:.2f} mm true"
        )
    if math.isfinite(rig.zero_sigma_px):
        far_m = result.depth_limit_m
        far = f"{far_m:.0f}" if far_m >= _WHOLE_METRES else f"{far_m:.1f}"
        rows.append(f"zero     disparity +- {rig.zero_sigma_px:.2f} px; depth beyond {far} m is a guess")
    return rows


def _sigma_mm(sigma_m: float) -> str:
    """Write an uncertainty in mm: two digits after the point, or two that are not 0."""
    return f"{sigma_m * 1e3:.2f}" if sigma_m >= 1e-5 else f"{sigma_m * 1e3:.2g}"


def _baseline_row(baseline_mm: float, sigma_m: float) -> str:
    if not math.isfinite(sigma_m):
        return f"baseline {baseline_mm:.2f} mm"
    share = sigma_m * 1e3 / baseline_mm
    vague = f": uncertain by {share:.0%}, and so is every depth" if share > SHARE_GOOD else ""
    return f"baseline {baseline_mm:.2f} +- {_sigma_mm(sigma_m)} mm{vague}"


def _lens_rows(found: Calibration) -> list[str]:
    """Return one line on the lenses, if one of them is not the usual one."""
    if set(found.bends) <= {Bend.USUAL}:
        return []
    kinds = (
        f"{side} {bend.lens.value}, {bend.terms} coefficients"
        for side, bend in zip(("left", "right"), found.bends, strict=True)
    )
    return [f"lens     {'; '.join(kinds)}"]


def _unwritten(report: CalibrationReport, out: Path) -> list[str]:
    """Say that there is no new rig, and where the earlier one is."""
    stays = "; the earlier one stays as it is" if report.earlier_rig else ""
    return [f"{out} was not written{stays}", f"look at {report.page}"]


def _written(report: CalibrationReport, out: Path) -> list[str]:
    rows = [
        f"written to {out} and {out.with_name(REPORT)}{earlier_words(report.earlier_rig)}",
        f"look at {report.page}",
    ]
    if report.verdict is Verdict.REJECT:
        rows.append(REFUSED)
    return rows
