"""report.json of `quality`: its keys are the fields of these classes. Lengths are metres, shares 0 to 1; null: not measured. Pure."""

from dataclasses import dataclass
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.model import Crop, Seen, Tiles
from phone_host.report.json_result import D5, FieldOf, json_values, made
from phone_host.report.quality_report import MeasuredPair, QualityReport, flaw, quality_verdict
from phone_host.report.report_page import Headline
from phone_host.report.stereo_json import FailedEntry
from phone_host.report.stereo_report import ALWAYS, FailedPair

_tiles, _pair, _report = FieldOf[Tiles](), FieldOf[MeasuredPair](), FieldOf[QualityReport]()

Grid = tuple[tuple[D5 | None, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TileGrid:
    """The figures over the image, by rows; its area as x, y, width and height."""

    area: tuple[int, ...] = _tiles(lambda tiles: _rectangle(tiles.area))
    fill: Grid = _tiles(lambda tiles: tiles.fill.tolist())
    scatter_px: Grid = _tiles(lambda tiles: tiles.scatter_px.tolist())
    offset_px: Grid = _tiles(lambda tiles: tiles.offset_px.tolist())
    offset_m: Grid = _tiles(lambda tiles: tiles.offset_m.tolist())
    offset_share: Grid = _tiles(lambda tiles: tiles.offset_share.tolist())


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredEntry:
    """A pair that was computed, and why it shows no plane."""

    name: str
    left: str
    right: str
    size: str = _pair(lambda pair: size_text(pair.rectified_px))
    seen: Seen
    problem: str | None = _pair(lambda pair: why.message if (why := flaw(pair.quality)) else None)
    remedy: str | None = _pair(lambda pair: why.remedy if (why := flaw(pair.quality)) else None)
    roi: tuple[int, ...] = _pair(lambda pair: _rectangle(pair.quality.roi))
    pixels: int
    fill: float | None
    off_plane: float | None
    plane_rms_m: float | None = _pair(lambda pair: pair.quality.rms_m)
    plane_rms_share: float | None = _pair(lambda pair: pair.quality.rms_share)
    subpixel_rms_px: float | None
    bend_px: float | None
    distance_m: float | None
    perpendicular_m: float | None
    tilt_deg: float | None
    true_m: float | None
    bias_m: float | None
    bias_share: float | None
    calibration_error_m: float | None
    board_misfit_px: float | None
    corners_bias_share: float | None
    theory_rms_m: float | None
    tiles: TileGrid = _pair(lambda pair: made(TileGrid, pair.quality.tiles))
    warnings: tuple[str, ...] = _pair(lambda pair: tuple(remark.text for remark in pair.remarks))


@dataclass(frozen=True, slots=True, kw_only=True)
class QualityResult:
    """What quality measured; focal length and baseline are those of the first plane."""

    format_version: int = REPORT_FORMAT
    command: str = "quality"
    verdict: Headline = _report(lambda report: quality_verdict(report)[0])
    headline: str = _report(lambda report: quality_verdict(report)[1])
    matcher: str
    planes: int = _report(lambda report: len(report.planes))
    interrupted_of: int | None = _report(lambda report: report.interrupted_of or None)
    sigma_px: float | None
    focal_px: float | None = _report(lambda report: report.planes[0].geometry.focal_px if report.planes else None)
    baseline_m: float | None = _report(lambda report: report.planes[0].geometry.baseline_m if report.planes else None)
    left_alone: tuple[str, ...]
    right_alone: tuple[str, ...]
    warnings: tuple[str, ...] = _report(lambda report: tuple(remark.text for remark in report.remarks))
    pairs: tuple[MeasuredEntry | FailedEntry, ...] = _report(
        lambda report: tuple(
            made(FailedEntry, pair)
            if isinstance(pair, FailedPair)
            else made(MeasuredEntry, pair, pair.quality, theory_rms_m=report.theory_m(pair.quality.distance_m))
            for pair in report.pairs
        )
    )
    files: tuple[str, ...] = ALWAYS


def quality_json(report: QualityReport) -> dict[str, Any]:
    """Make the object of report.json."""
    return json_values(made(QualityResult, report))


def _rectangle(area: Crop) -> tuple[int, ...]:
    return area.x_px, area.y_px, area.width_px, area.height_px
