"""The page that phone-host calibrate writes beside rig.yaml."""

from dataclasses import replace
from pathlib import Path

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.calibration.solve.series_snapshot import Taken, series_rig, series_views, view_turns
from phone_host.calibration.target.board_views import Mounted, fullest, rectified_view
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import Rejected
from phone_host.model import Rig, Verdict
from phone_host.model.calibration_series import CalibrationSeries
from phone_host.output.atomic import write_text
from phone_host.output.report_owner import PAGE
from phone_host.report.calibration_page import calibration_page
from phone_host.report.calibration_report import Judged
from phone_host.stereo.view_files import ViewFiles


def series_of_failure(taken: Taken, failure: DataError) -> CalibrationSeries:
    """Return what the page shows if there is no rig."""
    return CalibrationSeries(
        verdict=Verdict.REJECT,
        problem=failure.problem,
        remedy=failure.remedy,
        board=_board_words(taken.board),
        sizes_px=taken.views.sizes_px,
        views=series_views(taken, None, taken.views.rejected),
    )


def series_of_rig(taken: Taken, result: Judged, rig: Rig, rejected: tuple[Rejected, ...]) -> CalibrationSeries:
    """Return what the page shows of a rig, but for what is read from files again."""
    found, judgement = result.found, result.judgement
    used = {each.name for each in found.used}
    kept = [taken.as_seen(pair) for pair in taken.pairs if pair.name in used]
    return CalibrationSeries(
        verdict=judgement.verdict,
        remedy=judgement.remedy,
        cause="" if result.finding is None else result.finding.code,
        cause_words=result.cause_words,
        board=_board_words(taken.board),
        sizes_px=taken.views.sizes_px,
        views=series_views(taken, found, rejected),
        found=replace(series_rig(found, rig, result.depth_limit_m), measured_m=result.measured_m),
        turns=view_turns(kept, found.poses, taken.board.points_m(), found.rig),
        is_straightened=taken.is_straightened,
    )


def with_rectified(
    series: CalibrationSeries, taken: Taken, files: ViewFiles, mounted: Mounted, most_pixels: int
) -> CalibrationSeries:
    """Add one pair after rectification: the last one of a rig that turned, because it is as it stood then; else the one whose board is largest."""
    if series.found is None or series.found.rectification is None:
        return series
    rig, rectification = series.found.rig, series.found.rectification
    used = {view.name for view in series.views if view.is_used}
    paths = {name: (left, right) for name, left, right in files.pairs}
    shown = [own for pair in taken.pairs if pair.name in used and (own := taken.own(pair)) is not None]
    if not shown:
        return series
    one = shown[-1] if series.is_straightened else fullest(shown, rig, rectification)
    return replace(series, rectified=rectified_view(paths[one.name], one, rig, mounted, most_pixels))


def write_page(place: Path, series: CalibrationSeries, rig_file: str) -> None:
    """Write the page.

    Args:
        place: folder for it.
        series: what it shows.
        rig_file: name of the rig's file beside it, if one is written.

    Raises:
        OSError: it cannot be written.
    """
    is_written = series.found is not None and series.found.rectification is not None
    write_text(place / PAGE, calibration_page(replace(series, rig_file=rig_file if is_written else "")))


def _board_words(board: Board) -> str:
    return f"board of {size_text((board.columns, board.rows))} corners, squares of {board.square_m * 1e3:g} mm"
