"""report.json of phone-host calibrate: its keys are the fields of these classes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.errors import DataError
from common.imagesize.head import size_text
from common.orientation import UPRIGHT, Orientation
from common.versions import REPORT_FORMAT
from phone_host.calibration.failure_modes.mistakes import Turned
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.calibration.solve.verdict import Calibration, LensTrial, Used
from phone_host.calibration.target.board_views import BoardViews
from phone_host.model import CameraModel, Rig
from phone_host.report.calibration_report import CalibrationReport, Exported, ImportReport, Judged, Known
from phone_host.report.json_result import ABSENT, D1, D2, D3, D4, D6, Absent, FieldOf, json_values, made

_SIDES: Final = ("left", "right")

_used, _trial, _turn, _turned = FieldOf[Used](), FieldOf[LensTrial](), FieldOf[Orientation](), FieldOf[Turned]()
_live, _board, _import = FieldOf[GuideSnapshot](), FieldOf[Known](), FieldOf[ImportReport]()


@dataclass(frozen=True, slots=True)
class RejectedPair:
    """A pair that is not used, and why."""

    pair: str
    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class CalibrationPairs:
    """The pairs of pictures, and by what they were paired."""

    found: int
    used: int
    paired_by: str
    rejected: tuple[RejectedPair, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewErrors:
    """How well a view fits, and how the rig sees its board; without rectification there is no vertical error."""

    pair: str = _used(lambda used: used.name)
    left_px: D4
    right_px: D4
    vertical_px: D4 | None
    rays_miss_sigmas: D3 | None = _used(lambda used: used.in_space.miss)
    board_size: D6 | None = _used(lambda used: used.in_space.size)
    board_size_sigma: D6 | None = _used(lambda used: used.in_space.size_sigma)
    board_bow_mm: D3 | None = _used(lambda used: used.in_space.bow_m[0] * 1e3)
    board_bow_sigma_mm: D3 | None = _used(lambda used: used.in_space.bow_m[1] * 1e3)


@dataclass(frozen=True, slots=True)
class RmsErrors:
    """Root mean square errors of all corners, px."""

    left: D4
    right: D4
    stereo: D4


@dataclass(frozen=True, slots=True)
class VerticalError:
    """The vertical error after rectification, px; null where the rig cannot be rectified."""

    mean: D4 | None
    p95: D4 | None
    max: D4 | None


@dataclass(frozen=True, slots=True)
class LensTried:
    """How a formula predicts views that it has not seen."""

    kind: str = _trial(lambda trial: trial.bend.lens.value)
    coefficients: int = _trial(lambda trial: trial.bend.terms)
    held_out_px: D4 = _trial(lambda trial: trial.rms_px)


@dataclass(frozen=True, slots=True)
class LensChosen:
    """The formula of a camera's lens, and those that were tried."""

    kind: str
    coefficients: int
    tried: tuple[LensTried, ...]


Sigmas = tuple[float | None, ...]
"""Standard uncertainties; null where one was not estimated."""


@dataclass(frozen=True, slots=True)
class CameraSigmas:
    """Standard uncertainties of a camera's parameters."""

    focal_px: Sigmas
    principal_point_px: Sigmas
    coefficients: Sigmas


@dataclass(frozen=True, slots=True)
class RigSigmas:
    """Standard uncertainty of every parameter."""

    left: CameraSigmas
    right: CameraSigmas
    rotation_deg: Sigmas
    translation_mm: Sigmas


@dataclass(frozen=True, slots=True)
class DepthSigma:
    """The standard uncertainty of a depth by the calibration alone."""

    depth_mm: int
    depth_sigma_mm: D3 | None


@dataclass(frozen=True, slots=True)
class Squares:
    """Squares on boards that were held out, mm."""

    given: D4
    mean: D4 | None
    sigma: D4 | None


@dataclass(frozen=True, slots=True)
class Turn:
    """How images are turned."""

    rotate_deg: int
    flip: str = _turn(lambda turn: turn.flip.value)


@dataclass(frozen=True, slots=True)
class BoardTold:
    """The board, and who said how many corners it has."""

    inner_corners: str = _board(lambda known: size_text((known.board.columns, known.board.rows)))
    from_: str = _board(lambda known: known.origin.value)
    square_mm: D6 = _board(lambda known: known.board.square_m * 1e3)


@dataclass(frozen=True, slots=True, kw_only=True)
class CamerasTurned:
    """How the cameras turned against each other: about the right camera's x, y and z axis, from a pair on if at once."""

    course: str = _turned(lambda turned: turned.course.value)
    turn_deg: tuple[D4, ...] = _turned(lambda turned: tuple(math.degrees(each) for each in turned.turn_rad))
    sigma_deg: tuple[D4, ...] = _turned(lambda turned: tuple(math.degrees(each) for each in turned.sigma_rad))
    from_pair: str | None = _turned(lambda turned: turned.names[turned.begins] if turned.begins >= 0 else None)
    rows_px: D3
    depth_at_1_m_mm: D2 = _turned(lambda turned: turned.depth_at_1_m_m * 1e3)


@dataclass(frozen=True, slots=True)
class Cause:
    """What is wrong with the series."""

    name: str
    sentence: str
    remedy: str
    explained_px: D4 | None
    turned: CamerasTurned | Absent = ABSENT


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveTold:
    """How the pictures were taken."""

    ended: str = _live(lambda live: live.ended.value)
    views: int
    seconds: D1
    refused: Mapping[str, int] = _live(lambda live: {gate.value: count for gate, count in live.refused})


Files = Mapping[str, tuple[Path, ...]]
"""Files by the program that they are for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationResult:
    """What came of a calibration from pictures; without a rig there are no figures of one."""

    format_version: int = REPORT_FORMAT
    command: str = "calibrate"
    pairs: CalibrationPairs
    views: tuple[ViewErrors, ...] | Absent = ABSENT
    rms_px: RmsErrors | Absent = ABSENT
    vertical_error_px: VerticalError | Absent = ABSENT
    baseline_mm: D4 | Absent = ABSENT
    baseline_sigma_mm: D4 | Absent | None = ABSENT
    zero_sigma_px: D4 | Absent | None = ABSENT
    focal_px: Mapping[str, tuple[D3, ...]] | Absent = ABSENT
    sizes: Mapping[str, str | None] | Absent = ABSENT
    board_side: str | Absent = ABSENT
    lens: Mapping[str, LensChosen] | Absent = ABSENT
    distortion_coefficients: int | Absent = ABSENT
    sigmas: RigSigmas | Absent = ABSENT
    depth_sigmas: tuple[DepthSigma, ...] | Absent = ABSENT
    squares_mm: Squares | Absent = ABSENT
    board_spread: D3 | Absent = ABSENT
    largest_tilt_deg: D1 | Absent = ABSENT
    exif_orientation: Mapping[str, Turn] | Absent = ABSENT
    verdict: str
    problem: str | Absent = ABSENT
    remedy: str
    board: BoardTold
    depth_limit_m: D3 | Absent | None = ABSENT
    cause: Cause | Absent | None = ABSENT
    earlier_rig: str | Absent = ABSENT
    exported: Files | Absent = ABSENT
    live: LiveTold | Absent = ABSENT
    page: Path


@dataclass(frozen=True, slots=True)
class ImportedFrom:
    """Whose calibration it is, and what was decided for the user."""

    kind: str
    files: tuple[Path, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportResult:
    """What came of a calibration of another program."""

    format_version: int = REPORT_FORMAT
    command: str = "calibrate"
    imported: ImportedFrom = _import(
        lambda report: made(ImportedFrom, report.imported, kind=report.imported.kind.value)
    )
    baseline_mm: D4 = _import(lambda report: _baseline_mm(report.imported.rig))
    focal_px: Mapping[str, tuple[D3, ...]] = _import(lambda report: _focal_px(report.imported.rig))
    sizes: Mapping[str, str] = _import(lambda each: {side: _size(model) for side, model in _cameras(each.imported.rig)})
    board_side: str = _import(lambda report: report.imported.rig.board_side.value)
    verdict: str | None = _import(
        lambda each: None if each.imported.rig.verdict is None else each.imported.rig.verdict.value
    )
    earlier_rig: str | Absent = _import(lambda report: report.earlier_rig or ABSENT)
    exported: Files | Absent = _import(lambda report: _files(report.exported) or ABSENT)


def calibration_values(report: CalibrationReport) -> dict[str, Any]:
    """Return what report.json holds of a calibration from pictures."""
    files, result = report.files, report.result
    rejected = tuple(RejectedPair(each.name, each.reason.value, each.detail) for each in report.rejected)
    used = 0 if isinstance(result, DataError) else len(result.found.used)
    paired_by = "number" if files.by_number else "name" if files.by_name else "name order"
    told = CalibrationResult(
        pairs=CalibrationPairs(len(files.pairs), used, paired_by, rejected),
        exif_orientation=_turns(report.views) or ABSENT,
        verdict=report.verdict.value,
        remedy=report.remedy,
        board=made(BoardTold, report.known),
        earlier_rig=report.earlier_rig or ABSENT,
        exported=_files(report.exported) or ABSENT,
        live=made(LiveTold, report.live) or ABSENT,
        page=report.page,
    )
    if isinstance(result, DataError):
        return json_values(replace(told, problem=result.problem))
    return json_values(
        _with_figures(replace(told, depth_limit_m=result.depth_limit_m, cause=_cause(result)), result.found)
    )


def import_values(report: ImportReport) -> dict[str, Any]:
    """Return what report.json holds of a calibration of another program."""
    return json_values(made(ImportResult, report))


def _files(exported: tuple[Exported, ...]) -> Files:
    return {each.kind.value: each.files for each in exported}


def _turns(views: BoardViews) -> dict[str, Turn]:
    """Return what the EXIF headers of the sides say, where it changes anything."""
    sides = zip(_SIDES, views.turned, strict=True)
    return {side: made(Turn, turn) for side, turn in sides if turn != UPRIGHT}


def _cause(result: Judged) -> Cause | None:
    finding = result.finding
    if finding is None:
        return None
    turned = made(CamerasTurned, finding.evidence.turned) or ABSENT
    return Cause(finding.code, result.cause_words, finding.remedy, finding.evidence.explained_px, turned)


def _with_figures(told: CalibrationResult, found: Calibration) -> CalibrationResult:
    rig, rectified, squares = found.rig, found.rectification, found.squares
    px = found.vertical_px if found.obstacle is None else np.full(1, np.nan)
    rectified_size = None if rectified is None else f"{rectified.width_px}x{rectified.height_px}"
    return replace(
        told,
        views=tuple(
            made(ViewErrors, used, vertical_px=used.vertical_px if found.obstacle is None else math.nan)
            for used in found.used
        ),
        rms_px=RmsErrors(rig.rms_left_px, rig.rms_right_px, rig.rms_stereo_px),
        vertical_error_px=VerticalError(float(px.mean()), float(np.percentile(px, 95)), float(px.max())),
        baseline_mm=_baseline_mm(rig),
        baseline_sigma_mm=found.baseline_sigma_m * 1e3,
        zero_sigma_px=rig.zero_sigma_px,
        focal_px=_focal_px(rig),
        sizes={**{side: _size(model) for side, model in _cameras(rig)}, "rectified": rectified_size},
        board_side=rig.board_side.value,
        lens={
            side: LensChosen(bend.lens.value, bend.terms, made(LensTried, trials))
            for side, bend, trials in zip(_SIDES, found.bends, found.trials, strict=True)
        },
        distortion_coefficients=max(bend.terms for bend in found.bends),
        sigmas=_sigmas(rig),
        depth_sigmas=tuple(DepthSigma(round(depth_m * 1e3), sigma_m * 1e3) for depth_m, sigma_m in found.depths),
        squares_mm=Squares(squares.true_m * 1e3, squares.mean_m * 1e3, squares.sigma_m * 1e3),
        board_spread=found.spread,
        largest_tilt_deg=float(found.tilts_deg.max()),
    )


def _cameras(rig: Rig) -> tuple[tuple[str, CameraModel], ...]:
    return (("left", rig.left), ("right", rig.right))


def _size(model: CameraModel) -> str:
    return f"{model.width_px}x{model.height_px}"


def _baseline_mm(rig: Rig) -> float:
    return float(np.linalg.norm(rig.t_right_left_m)) * 1e3


def _focal_px(rig: Rig) -> dict[str, tuple[float, ...]]:
    return {side: tuple(float(model.matrix[i, i]) for i in (0, 1)) for side, model in _cameras(rig)}


def _sigmas(rig: Rig) -> RigSigmas:
    """Return the standard uncertainty of every parameter."""
    sigmas = np.sqrt(np.diag(rig.covariance).clip(min=0))
    known = tuple(float(f"{sigma:.4g}") if sigma > 0 else None for sigma in sigmas)
    left, right = (CameraSigmas(known[at : at + 2], known[at + 2 : at + 4], known[at + 4 : at + 12]) for at in (0, 12))
    turn, place = (
        tuple(float(f"{each:.4g}") if math.isfinite(each) else None for each in row)
        for row in (np.degrees(sigmas[24:27]), sigmas[27:] * 1e3)
    )
    return RigSigmas(left, right, turn, place)
