"""What phone-host calibrate reports: report.json's values, and the same as text."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from common.errors import DataError
from common.orientation import UPRIGHT
from common.versions import REPORT_FORMAT
from common.words import counted
from phone_host.calibration.bend import Bend
from phone_host.calibration.board_pairs import Calibration, Rejected
from phone_host.calibration.board_views import BoardViews, turn_text
from phone_host.calibration.fit_quality import LensTrial
from phone_host.calibration.verdict import SHARE_GOOD, Assessment
from phone_host.declared_settings import NEAR_M
from phone_host.model import Rectification, Rig, Verdict
from phone_host.model.calibration_series import BoardInSpace
from phone_host.stereo.depth_limits import DepthWanted, depth_limits, disparity_error_px
from phone_host.stereo.reproject import disparities_for_near
from phone_host.stereo.view_files import ViewFiles, is_unread_photograph
from phone_host.stereo.working import chosen_scale
from phone_host.verbs.calibrate.importing import REFUSED
from phone_host.verbs.calibrate.rig_file import earlier_words

_SHOWN = 3
_WHOLE_METRES = 10.0
"""From here on a limit in tenths of a metre says nothing."""


def report_of(
    files: ViewFiles, views: BoardViews, rejected: tuple[Rejected, ...], calibration: Calibration, judgement: Assessment
) -> dict[str, Any]:
    """Return the report of a calibration that gave a rig."""
    return {
        "format_version": REPORT_FORMAT,
        "command": "calibrate",
        "pairs": _pairs(files, rejected, len(calibration.used)),
        **_figures(calibration),
        **_turned(views),
        "verdict": judgement.verdict.value,
        "remedy": judgement.remedy,
    }


def report_of_failure(files: ViewFiles, views: BoardViews, error: DataError) -> dict[str, Any]:
    """Return the report of a calibration that gave no rig."""
    return {
        "format_version": REPORT_FORMAT,
        "command": "calibrate",
        "pairs": _pairs(files, views.rejected, 0),
        **_turned(views),
        "verdict": Verdict.REJECT.value,
        "problem": error.problem,
        "remedy": error.remedy,
    }


def _turned(views: BoardViews) -> dict[str, Any]:
    """Return what the EXIF headers of the sides say, where it changes anything."""
    sides = {side: turn for side, turn in zip(("left", "right"), views.turned, strict=True) if turn != UPRIGHT}
    turns = {side: {"rotate_deg": turn.rotate_deg, "flip": turn.flip.value} for side, turn in sides.items()}
    return {"exif_orientation": turns} if turns else {}


def _pairs(files: ViewFiles, rejected: tuple[Rejected, ...], used: int) -> dict[str, Any]:
    return {
        "found": len(files.pairs),
        "used": used,
        "paired_by": "number" if files.by_number else "name" if files.by_name else "name order",
        "rejected": [{"pair": each.name, "reason": each.reason.value, "detail": each.detail} for each in rejected],
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
                **_in_space(used.in_space),
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
        "baseline_sigma_mm": _rounded(calibration.baseline_sigma_m * 1e3, 4),
        "zero_sigma_px": _rounded(rig.zero_sigma_px, 4),
        "depth_limit_m": _rounded(depth_limit_m(calibration), 3),
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
        "lens": {
            side: {"kind": bend.lens.value, "coefficients": bend.terms, "tried": _tried(trials)}
            for side, bend, trials in zip(("left", "right"), calibration.bends, calibration.trials, strict=True)
        },
        "distortion_coefficients": max(bend.terms for bend in calibration.bends),
        "sigmas": _sigmas(rig),
        "depth_sigmas": [
            {"depth_mm": round(depth_m * 1e3), "depth_sigma_mm": _rounded(sigma_m * 1e3, 3)}
            for depth_m, sigma_m in calibration.depths
        ],
        "squares_mm": {
            "given": round(calibration.squares.true_m * 1e3, 4),
            "mean": _rounded(calibration.squares.mean_m * 1e3, 4),
            "sigma": _rounded(calibration.squares.sigma_m * 1e3, 4),
        },
        "board_spread": round(calibration.spread, 3),
        "largest_tilt_deg": round(float(calibration.tilts_deg.max()), 1),
    }


def _in_space(board: BoardInSpace) -> dict[str, float | None]:
    """Return how a rig sees a view's board."""
    bow_m, sigma_m = board.bow_m
    return {
        "rays_miss_sigmas": _rounded(board.miss, 3),
        "board_size": _rounded(board.size, 6),
        "board_size_sigma": _rounded(board.size_sigma, 6),
        "board_bow_mm": _rounded(bow_m * 1e3, 3),
        "board_bow_sigma_mm": _rounded(sigma_m * 1e3, 3),
    }


def _tried(trials: tuple[LensTrial, ...]) -> list[dict[str, Any]]:
    """Return how each formula that was tried predicts views that it has not seen."""
    return [
        {"kind": each.bend.lens.value, "coefficients": each.bend.terms, "held_out_px": round(each.rms_px, 4)}
        for each in trials
    ]


def _sigmas(rig: Rig) -> dict[str, Any]:
    """Return the standard uncertainty of every parameter; null where it was not estimated."""
    sigmas = np.sqrt(np.diag(rig.covariance).clip(min=0))
    known: list[float | None] = [float(f"{sigma:.4g}") if sigma > 0 else None for sigma in sigmas]
    cameras = {
        side: {
            "focal_px": known[at : at + 2],
            "principal_point_px": known[at + 2 : at + 4],
            "coefficients": known[at + 4 : at + 12],
        }
        for side, at in (("left", 0), ("right", 12))
    }
    pose = {"rotation_deg": np.degrees(sigmas[24:27]), "translation_mm": sigmas[27:] * 1e3}
    rounded = {
        key: [float(f"{each:.4g}") if math.isfinite(each) else None for each in row] for key, row in pose.items()
    }
    return cameras | rounded


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if math.isfinite(value) else None


def depth_limit_m(calibration: Calibration) -> float:
    """Return the far limit that `stereo` uses with this rig if the user gives none, m; NaN if it cannot be rectified."""
    made: Rectification | None = calibration.rectification
    if made is None:
        return math.nan
    along, across = (made.height_px, made.width_px) if made.epipolar.is_vertical else (made.width_px, made.height_px)
    scale = chosen_scale(along, across, disparities_for_near(made.geometry, NEAR_M, along))
    error_px = disparity_error_px(scale, calibration.rig.zero_sigma_px)
    return depth_limits(made.geometry, error_px, DepthWanted()).far_m


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
    counts = f"{left} left and {right} right pictures"
    return [f"warning  {counts} were paired in the order of their names, because the names share no numbers"]


def unwritten(report: dict[str, Any], out: Path) -> list[str]:
    """Say that there is no new rig, and where the earlier one is."""
    stays = "; the earlier one stays as it is" if "earlier_rig" in report else ""
    return [f"{out} was not written{stays}", f"look at {report['page']}"]


def _sigma_mm(sigma_m: float) -> str:
    """Write an uncertainty in mm: two digits after the point, or two that are not 0."""
    return f"{sigma_m * 1e3:.2f}" if sigma_m >= 1e-5 else f"{sigma_m * 1e3:.2g}"


def summary(
    report: dict[str, Any], views: BoardViews, calibration: Calibration, rejected: tuple[Rejected, ...], out: Path
) -> list[str]:
    """Return the report as lines of text."""
    # A rig that cannot be rectified has no vertical errors.
    known = calibration.obstacle is None
    rows = [f"{'pair':>8}  {'left px':>8} {'right px':>8}" + (f" {'vertical px':>11}" if known else "")]
    rows += [
        f"{u.name:>8}  {u.left_px:8.3f} {u.right_px:8.3f}" + (f" {u.vertical_px:11.3f}" if known else "")
        for u in calibration.used
    ]
    rows += rejections(rejected)
    rms, vertical, used = report["rms_px"], report["vertical_error_px"], report["pairs"]["used"]
    rows.append(f"{counted(used, 'pair')} used, {len(rejected)} rejected")
    for side, turn in zip(("left", "right"), views.turned, strict=True):
        if turn != UPRIGHT:
            rows.append(f"EXIF     {side} images are {turn_text(turn)}")
    rows.append(f"RMS      left {rms['left']:.3f}, right {rms['right']:.3f}, stereo {rms['stereo']:.3f} px")
    if vertical["p95"] is not None:
        rows.append(f"vertical mean {vertical['mean']:.3f}, 95 % {vertical['p95']:.3f}, max {vertical['max']:.3f} px")
    rows.append(_baseline_row(report["baseline_mm"], calibration.baseline_sigma_m))
    if known:
        rows.append("         compare it with a ruler: it shows a wrong --square")
    rows += _lens_rows(calibration)
    errors = ", ".join(
        f"{_sigma_mm(sigma_m)} mm at {depth_m:g} m" for depth_m, sigma_m in calibration.depths if math.isfinite(sigma_m)
    )
    if errors:
        rows.append(f"depth    +- {errors} by the calibration alone")
    squares = calibration.squares
    if squares.count:
        rows.append(
            f"squares  {squares.mean_m * 1e3:.2f} +- {_sigma_mm(squares.sigma_m)} mm on boards that were held out, {squares.true_m * 1e3:.2f} mm true"
        )
    if report["zero_sigma_px"] is not None:
        far_m = report["depth_limit_m"]
        far = f"{far_m:.0f}" if far_m >= _WHOLE_METRES else f"{far_m:.1f}"
        rows.append(f"zero     disparity +- {report['zero_sigma_px']:.2f} px; depth beyond {far} m is a guess")
    rows.append(f"verdict  {report['verdict']}")
    if not report["remedy"] and report["cause"] is not None:
        rows.append(f"note     {report['cause']['sentence']}")
    rows += [f"remedy   {report['remedy']}"] if report["remedy"] else []
    return [*rows, *_written(report, calibration, out)]


def _baseline_row(baseline_mm: float, sigma_m: float) -> str:
    if not math.isfinite(sigma_m):
        return f"baseline {baseline_mm:.2f} mm"
    share = sigma_m * 1e3 / baseline_mm
    vague = f": uncertain by {share:.0%}, and so is every depth" if share > SHARE_GOOD else ""
    return f"baseline {baseline_mm:.2f} +- {_sigma_mm(sigma_m)} mm{vague}"


def _lens_rows(calibration: Calibration) -> list[str]:
    """Return one line on the lenses, if one of them is not the usual one."""
    if set(calibration.bends) <= {Bend.USUAL}:
        return []
    kinds = (
        f"{side} {bend.lens.value}, {bend.terms} coefficients"
        for side, bend in zip(("left", "right"), calibration.bends, strict=True)
    )
    return [f"lens     {'; '.join(kinds)}"]


def _written(report: dict[str, Any], calibration: Calibration, out: Path) -> list[str]:
    if calibration.rectification is None:
        return unwritten(report, out)
    rows = [f"written to {out} and {out.with_name('report.json')}{earlier_words(report)}", f"look at {report['page']}"]
    if report["verdict"] == Verdict.REJECT.value:
        rows.append(REFUSED)
    return rows
