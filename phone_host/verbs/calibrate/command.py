"""phone-host calibrate: calibrate two cameras from pictures of a chessboard."""

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from common.errors import DataError, UnavailableError
from common.versions import REPORT_FORMAT
from phone_host.calibration.board_pairs import Calibration, Reason, Rejected
from phone_host.calibration.board_views import BoardViews, look_for_boards
from phone_host.calibration.calibrate import calibrate
from phone_host.calibration.target import Board, parse_board
from phone_host.calibration.verdict import Verdict, judge
from phone_host.calibration.view_files import ViewFiles, pair_files
from phone_host.model import Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_yaml import is_rig, write_rig
from phone_host.settings import most_pixels
from phone_host.verbs.output_folders import claim_names, keep_other_report, require_file, unwritable

_CHECK_FAILED = 4

_NOT_FOUND = frozenset({Reason.NOT_FOUND_LEFT, Reason.NOT_FOUND_RIGHT, Reason.NOT_FOUND_BOTH})
_COUNT_CORNERS = (
    "check --board: it counts inner corners, one less than the squares each way (10x7 squares are --board 9x6); or take 15 or"
    " more pairs with the whole board sharp in both images"
)


def run(options: argparse.Namespace) -> int:
    """Find the chessboard in all pairs, calibrate, judge and write."""
    board = parse_board(options.board, options.square)
    require_file(options.out)
    if options.out.exists() and not is_rig(options.out):
        raise UnavailableError(f"{options.out} is not a calibration, and would be replaced", "name another --out")
    files = pair_files(options.left, options.right)
    keep_other_report(options.out.parent, "calibrate")
    claim_names(options.out.parent, options.out, "report.json")
    views = _look(files, board, most_pixels(None, options.max_megapixels))
    try:
        calibration = calibrate(list(views.pairs), board, views.sizes_px, Side(options.board_side))
    except DataError as failure:
        unseen = sum(each.reason in _NOT_FOUND for each in views.rejected)
        error = DataError(failure.problem, _COUNT_CORNERS) if 2 * unseen > len(files.pairs) else failure
        report = _failed(files, views, error) | _write_rig(options.out, None)
        _write_report(options.out, report)
        print(
            json_text(report)
            if options.json
            else "\n".join([_rejections(views.rejected), *_unwritten(report, options.out)])
        )
        raise error from None
    rejected = (*views.rejected, *calibration.rejected)
    judgement = judge(calibration, rejected)
    report = {
        "format_version": REPORT_FORMAT,
        "pairs": _pairs(files, rejected, len(calibration.used)),
        **_figures(calibration),
        "verdict": judgement.verdict.value,
        "remedy": "; ".join(judgement.remedies),
        **_write_rig(options.out, calibration),
    }
    _write_report(options.out, report)
    print(json_text(report) if options.json else _summary(report, calibration, rejected, options.out))
    return _CHECK_FAILED if judgement.verdict is Verdict.REJECT else 0


def _look(files: ViewFiles, board: Board, limit: int) -> BoardViews:
    """Search all images, with a progress bar if stderr is a terminal."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("looking for the board", total=len(files.pairs))
        return look_for_boards(files, board, lambda: progress.advance(task), limit)


def _pairs(files: ViewFiles, rejected: tuple[Rejected, ...], used: int) -> dict[str, Any]:
    return {
        "found": len(files.pairs),
        "used": used,
        "paired_by": "number" if files.by_number else "name order",
        "rejected": [{"pair": each.name, "reason": each.reason.value, "detail": each.detail} for each in rejected],
    }


def _failed(files: ViewFiles, views: BoardViews, error: DataError) -> dict[str, Any]:
    """Return the report for a calibration that gave no rig."""
    return {
        "format_version": REPORT_FORMAT,
        "pairs": _pairs(files, views.rejected, 0),
        "verdict": "reject",
        "problem": error.problem,
        "remedy": error.remedy,
    }


def _figures(calibration: Calibration) -> dict[str, Any]:
    rig, vertical = calibration.rig, calibration.vertical_px
    known = calibration.obstacle is None
    return {
        "views": [
            {
                "pair": used.name,
                "left_px": round(used.left_px, 4),
                "right_px": round(used.right_px, 4),
                "vertical_px": round(used.vertical_px, 4) if known else None,
            }
            for used in calibration.used
        ],
        "rms_px": {
            "left": round(rig.rms_left_px, 4),
            "right": round(rig.rms_right_px, 4),
            "stereo": round(rig.rms_stereo_px, 4),
        },
        "vertical_error_px": {
            "mean": round(float(vertical.mean()), 4) if known else None,
            "p95": round(float(np.percentile(vertical, 95)), 4) if known else None,
            "max": round(float(vertical.max()), 4) if known else None,
        },
        "baseline_mm": round(float(np.linalg.norm(rig.t_right_left_m)) * 1e3, 4),
        "baseline_sigma_mm": round(calibration.baseline_sigma_m * 1e3, 4)
        if math.isfinite(calibration.baseline_sigma_m)
        else None,
        "focal_px": {
            "left": [round(float(rig.left.matrix[i, i]), 3) for i in (0, 1)],
            "right": [round(float(rig.right.matrix[i, i]), 3) for i in (0, 1)],
        },
        "sizes": {
            "left": f"{rig.left.width_px}x{rig.left.height_px}",
            "right": f"{rig.right.width_px}x{rig.right.height_px}",
            "rectified": None
            if calibration.rectification is None
            else f"{calibration.rectification.width_px}x{calibration.rectification.height_px}",
        },
        "board_side": rig.board_side.value,
        "distortion_coefficients": calibration.distortion_terms,
        "board_spread": round(calibration.spread, 3),
        "largest_tilt_deg": round(float(calibration.tilts_deg.max()), 1),
    }


def _write_rig(out: Path, calibration: Calibration | None) -> dict[str, str]:
    """Write rig.yaml. If there is no usable rig, move the rig of an earlier run aside, so that nobody takes it for this run's.

    Returns:
        For the report: where the earlier rig is now, if it was moved.
    """
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if calibration is not None and calibration.rectification is not None:
            write_rig(out, calibration.rig, calibration.rectification)
        elif out.exists():
            aside = out.with_name(f"{out.name}.old")
            out.replace(aside)
            return {"earlier_rig": aside.name}
    except OSError as error:
        raise unwritable(out, error) from error
    return {}


def _unwritten(report: dict[str, Any], out: Path) -> list[str]:
    """Say that there is no new rig, and where the earlier one is."""
    earlier = f"; the earlier one is now {report['earlier_rig']}" if "earlier_rig" in report else ""
    return [f"{out} was not written{earlier}"]


def _write_report(out: Path, report: dict[str, Any]) -> None:
    try:
        write_text(out.with_name("report.json"), json_text(report, indent=2) + "\n")
    except OSError as error:
        raise unwritable(out, error) from error


def _rejections(rejected: tuple[Rejected, ...]) -> str:
    return "\n".join(f"{each.name:>8}  rejected: {each.reason.value} ({each.detail})" for each in rejected)


def _summary(report: dict[str, Any], calibration: Calibration, rejected: tuple[Rejected, ...], out: Path) -> str:
    rows = [f"{'pair':>8}  {'left px':>8} {'right px':>8} {'vertical px':>11}"]
    rows += [f"{u.name:>8}  {u.left_px:8.3f} {u.right_px:8.3f} {u.vertical_px:11.3f}" for u in calibration.used]
    if rejected:
        rows.append(_rejections(rejected))
    rms, vertical = report["rms_px"], report["vertical_error_px"]
    rows += [
        f"{report['pairs']['used']} pairs used, {len(rejected)} rejected",
        f"RMS      left {rms['left']:.3f}, right {rms['right']:.3f}, stereo {rms['stereo']:.3f} px",
    ]
    if vertical["p95"] is not None:
        rows.append(f"vertical mean {vertical['mean']:.3f}, 95 % {vertical['p95']:.3f}, max {vertical['max']:.3f} px")
    rows += [
        f"baseline {report['baseline_mm']:.2f} +- {calibration.baseline_sigma_m * 1e3:.2f} mm",
        f"verdict  {report['verdict']}",
        *(f"remedy   {remedy}" for remedy in report["remedy"].split("; ") if remedy),
    ]
    if calibration.rectification is not None:
        rows.append(f"written to {out} and {out.with_name('report.json')}")
    else:
        rows += _unwritten(report, out)
    return "\n".join(rows)
