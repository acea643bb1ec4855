"""report.json of phone-host calibrate: the one place where its keys stand."""

import math
from typing import Any

import numpy as np

from common.errors import DataError
from common.imagesize.head import size_text
from common.orientation import UPRIGHT
from common.versions import REPORT_FORMAT
from phone_host.calibration.failure_modes.mistakes import Turned
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.calibration.solve.result import Calibration, LensTrial, Used
from phone_host.calibration.target.board_views import BoardViews
from phone_host.model import Rig
from phone_host.output.json_text import json_number
from phone_host.report.calibration_report import CalibrationReport, Exported, ImportReport, Judged, Known


def report_values(report: CalibrationReport) -> dict[str, Any]:
    """Return what report.json holds of a calibration from pictures."""
    result = report.result
    return {
        **_HEAD,
        "pairs": _pairs(report),
        **({} if isinstance(result, DataError) else _figures(result.found)),
        **_turned(report.views),
        "verdict": report.verdict.value,
        **({"problem": result.problem} if isinstance(result, DataError) else {}),
        "remedy": report.remedy,
        "board": _board(report.known),
        **({} if isinstance(result, DataError) else _judged(result)),
        **_written(report.earlier_rig, report.exported),
        **({} if report.live is None else {"live": _live(report.live)}),
        "page": str(report.page),
    }


def import_values(report: ImportReport) -> dict[str, Any]:
    """Return what report.json holds of a calibration of another program."""
    found, rig = report.imported, report.imported.rig
    cameras = {"left": rig.left, "right": rig.right}
    return {
        **_HEAD,
        "imported": {
            "kind": found.kind.value,
            "files": [str(path) for path in found.files],
            "notes": list(found.notes),
        },
        "baseline_mm": _baseline_mm(rig),
        "focal_px": _focal_px(rig),
        "sizes": {side: f"{model.width_px}x{model.height_px}" for side, model in cameras.items()},
        "board_side": rig.board_side.value,
        "verdict": None if rig.verdict is None else rig.verdict.value,
        **_written(report.earlier_rig, report.exported),
    }


_HEAD: dict[str, Any] = {"format_version": REPORT_FORMAT, "command": "calibrate"}


def _written(earlier_rig: str, exported: tuple[Exported, ...]) -> dict[str, Any]:
    files = {each.kind.value: [str(path) for path in each.files] for each in exported}
    return ({"earlier_rig": earlier_rig} if earlier_rig else {}) | ({"exported": files} if files else {})


def _live(last: GuideSnapshot) -> dict[str, Any]:
    return {
        "ended": last.ended.value,
        "views": last.views,
        "seconds": round(last.seconds, 1),
        "refused": {gate.value: count for gate, count in last.refused},
    }


def _board(known: Known) -> dict[str, Any]:
    return {
        "inner_corners": size_text((known.board.columns, known.board.rows)),
        "from": known.origin.value,
        "square_mm": round(known.board.square_m * 1e3, 6),
    }


def _pairs(report: CalibrationReport) -> dict[str, Any]:
    files, result = report.files, report.result
    return {
        "found": len(files.pairs),
        "used": 0 if isinstance(result, DataError) else len(result.found.used),
        "paired_by": "number" if files.by_number else "name" if files.by_name else "name order",
        "rejected": [
            {"pair": each.name, "reason": each.reason.value, "detail": each.detail} for each in report.rejected
        ],
    }


def _turned(views: BoardViews) -> dict[str, Any]:
    """Return what the EXIF headers of the sides say, where it changes anything."""
    sides = {side: turn for side, turn in zip(("left", "right"), views.turned, strict=True) if turn != UPRIGHT}
    turns = {side: {"rotate_deg": turn.rotate_deg, "flip": turn.flip.value} for side, turn in sides.items()}
    return {"exif_orientation": turns} if turns else {}


def _judged(result: Judged) -> dict[str, Any]:
    finding = result.finding
    if finding is None:
        return {"depth_limit_m": json_number(result.depth_limit_m, 3), "cause": None}
    cause: dict[str, Any] = {
        "name": finding.code,
        "sentence": result.cause_words,
        "remedy": finding.remedy,
        "explained_px": json_number(finding.evidence.explained_px, 4),
    }
    if finding.evidence.turned is not None:
        cause["turned"] = _turn(finding.evidence.turned)
    return {"depth_limit_m": json_number(result.depth_limit_m, 3), "cause": cause}


def _turn(turned: Turned) -> dict[str, Any]:
    return {
        "course": turned.course.value,
        "turn_deg": [round(math.degrees(each), 4) for each in turned.turn_rad],
        "sigma_deg": [round(math.degrees(each), 4) for each in turned.sigma_rad],
        "from_pair": turned.names[turned.begins] if turned.begins >= 0 else None,
        "rows_px": round(turned.rows_px, 3),
        "depth_at_1_m_mm": round(turned.depth_at_1_m_m * 1e3, 2),
    }


def _figures(found: Calibration) -> dict[str, Any]:
    rig, rectified, squares = found.rig, found.rectification, found.squares
    sizes = {side: f"{model.width_px}x{model.height_px}" for side, model in (("left", rig.left), ("right", rig.right))}
    return {
        "views": [_view(used, is_rectified=found.obstacle is None) for used in found.used],
        "rms_px": {
            "left": round(rig.rms_left_px, 4),
            "right": round(rig.rms_right_px, 4),
            "stereo": round(rig.rms_stereo_px, 4),
        },
        "vertical_error_px": _vertical(found),
        "baseline_mm": _baseline_mm(rig),
        "baseline_sigma_mm": json_number(found.baseline_sigma_m * 1e3, 4),
        "zero_sigma_px": json_number(rig.zero_sigma_px, 4),
        "focal_px": _focal_px(rig),
        "sizes": {**sizes, "rectified": None if rectified is None else f"{rectified.width_px}x{rectified.height_px}"},
        "board_side": rig.board_side.value,
        "lens": {
            side: {"kind": bend.lens.value, "coefficients": bend.terms, "tried": _tried(trials)}
            for side, bend, trials in zip(("left", "right"), found.bends, found.trials, strict=True)
        },
        "distortion_coefficients": max(bend.terms for bend in found.bends),
        "sigmas": _sigmas(rig),
        "depth_sigmas": [
            {"depth_mm": round(depth_m * 1e3), "depth_sigma_mm": json_number(sigma_m * 1e3, 3)}
            for depth_m, sigma_m in found.depths
        ],
        "squares_mm": {
            "given": round(squares.true_m * 1e3, 4),
            "mean": json_number(squares.mean_m * 1e3, 4),
            "sigma": json_number(squares.sigma_m * 1e3, 4),
        },
        "board_spread": round(found.spread, 3),
        "largest_tilt_deg": round(float(found.tilts_deg.max()), 1),
    }


def _view(used: Used, *, is_rectified: bool) -> dict[str, Any]:
    """Return how well a view fits, and how the rig sees its board."""
    board = used.in_space
    bow_m, sigma_m = board.bow_m
    return {
        "pair": used.name,
        "left_px": round(used.left_px, 4),
        "right_px": round(used.right_px, 4),
        "vertical_px": round(used.vertical_px, 4) if is_rectified else None,
        "rays_miss_sigmas": json_number(board.miss, 3),
        "board_size": json_number(board.size, 6),
        "board_size_sigma": json_number(board.size_sigma, 6),
        "board_bow_mm": json_number(bow_m * 1e3, 3),
        "board_bow_sigma_mm": json_number(sigma_m * 1e3, 3),
    }


def _vertical(found: Calibration) -> dict[str, Any]:
    """Return the vertical error; null where the rig cannot be rectified."""
    px = found.vertical_px if found.obstacle is None else np.full(1, np.nan)
    return {
        "mean": json_number(float(px.mean()), 4),
        "p95": json_number(float(np.percentile(px, 95)), 4),
        "max": json_number(float(px.max()), 4),
    }


def _baseline_mm(rig: Rig) -> float:
    return round(float(np.linalg.norm(rig.t_right_left_m)) * 1e3, 4)


def _focal_px(rig: Rig) -> dict[str, list[float]]:
    return {
        side: [round(float(model.matrix[i, i]), 3) for i in (0, 1)]
        for side, model in (("left", rig.left), ("right", rig.right))
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
