"""report.json of `scan`: its keys are the fields of these classes. Lengths are metres, shares 0 to 1; null: not measured. Pure.

It holds no times: equal pairs give equal bytes.
"""

import math
from dataclasses import dataclass
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.model import UnseenSurface
from phone_host.report.json_result import D4, D6, FieldOf, Number, json_values, made
from phone_host.report.report_page import Headline
from phone_host.report.scan_report import MatFigures, ScanReport, scan_verdict
from phone_host.report.stereo_report import FailedPair
from phone_host.scan.mat_pose import MatSaid
from phone_host.scan.scanned import PoseOrigin, ScannedPair
from phone_host.scan.surface_error import ErrorScope
from phone_host.scan.tracking_words import Tracking, Weakness

_pair, _failed, _seen = FieldOf[ScannedPair](), FieldOf[FailedPair](), FieldOf[MatSaid]()
_mat, _scan = FieldOf[MatFigures](), FieldOf[ScanReport]()


@dataclass(frozen=True, slots=True, kw_only=True)
class LostEntry:
    """A pair that could not be computed."""

    name: str
    problem: str = _failed(lambda pair: pair.failure.message)
    remedy: str = _failed(lambda pair: pair.failure.remedy)


@dataclass(frozen=True, slots=True, kw_only=True)
class MatSeen:
    """What the mat told of a pair."""

    left: int = _seen(lambda mat: mat.seen[0])
    right: int = _seen(lambda mat: mat.seen[1])
    rms_px: Number
    sigma_m: Number


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannedEntry:
    """A pair that was computed, and where its camera was."""

    name: str
    stamp_s: float
    state: Tracking
    pose: PoseOrigin = _pair(lambda pair: pair.pose_origin)
    weakness: Weakness
    density: D4
    corners: int
    overlap: Number
    off_m: Number
    mat: MatSeen | None = _pair(lambda pair: made(MatSeen, pair.mat))
    place_m: tuple[D6, ...] | None = _pair(
        lambda pair: None if pair.pose_origin is PoseOrigin.NONE else pair.world_camera.t_m.tolist()
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class MatOfScan:
    """The mat under the object, and its squares as the rig measures them."""

    name: str
    pairs: int
    corners: int
    seen_left: float = _mat(lambda mat: mat.seen[0])
    seen_right: float = _mat(lambda mat: mat.seen[1])
    sigma_m: Number
    square_m: float
    measured_m: Number
    measured_sigma_m: Number
    to_scale: bool = _mat(lambda mat: mat.is_to_scale)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannedModel:
    """The model in numbers."""

    axes: str = _scan(lambda scan: scan.axes.text)
    points: int
    triangles: int
    area_m2: D6 = _scan(lambda scan: scan.model.size.area_m2)
    border_m: D6 = _scan(lambda scan: scan.model.size.border_m)
    extent_m: tuple[D6, ...] = _scan(lambda scan: scan.model.size.extent_m)
    noise_m: Number
    noise_p95_m: Number
    drift_included: bool | None = _scan(
        lambda scan: scan.model.error_scope is ErrorScope.DRIFT if math.isfinite(scan.model.noise_m) else None
    )
    unseen_share: Number
    unseen: UnseenSurface
    voxel_m: float | None = _scan(lambda scan: scan.settings.voxel_m if scan.settings else None)
    far_m: D6 | None = _scan(lambda scan: scan.settings.far_m if scan.settings else None)
    memory_bytes: int
    blocks_left_out: int = _scan(lambda scan: scan.model.left_out)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanResult:
    """What came of a scan."""

    format_version: int = REPORT_FORMAT
    command: str = "scan"
    verdict: Headline = _scan(lambda scan: scan_verdict(scan)[0])
    headline: str = _scan(lambda scan: scan_verdict(scan)[1])
    matcher: str
    size: str = _scan(lambda scan: size_text(scan.rectified_px))
    focal_px: float | None = _scan(lambda scan: scan.geometry.focal_px if scan.geometry else None)
    baseline_m: float | None = _scan(lambda scan: scan.geometry.baseline_m if scan.geometry else None)
    in_model: int = _scan(lambda scan: scan.fused)
    interrupted_of: int | None = _scan(lambda scan: scan.interrupted_of or None)
    path_m: D6
    off_model_m: Number = _scan(lambda scan: scan.off_m)
    mat: MatOfScan | None = _scan(lambda scan: made(MatOfScan, scan.on_mat))
    model: ScannedModel = _scan(lambda scan: made(ScannedModel, scan, scan.model))
    warnings: tuple[str, ...] = _scan(lambda scan: tuple(remark.text for remark in scan.remarks))
    pairs: tuple[ScannedEntry | LostEntry, ...] = _scan(
        lambda scan: tuple(made(LostEntry if isinstance(p, FailedPair) else ScannedEntry, p) for p in scan.pairs)
    )
    files: tuple[str, ...]


def scan_json(report: ScanReport) -> dict[str, Any]:
    """Make the object of report.json."""
    return json_values(made(ScanResult, report))
