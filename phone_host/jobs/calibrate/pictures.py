"""Calibrates from pictures, whoever took them, and writes what came of it: for the command, and for the page."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.calibration.failure_modes.mistakes import Course, unturned
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake, placed
from phone_host.calibration.failure_modes.partners import out_of_step
from phone_host.calibration.failure_modes.remedies import arrangement_hint, assessed, out_of_step_error
from phone_host.calibration.guide.wants import guessed_corners, with_corners
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.series_snapshot import Taken
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.board_views import BoardViews, look_for_boards
from phone_host.calibration.target.cameras_beside import cameras_beside, require_sizes, with_cameras
from phone_host.calibration.target.pairs import BoardPair, Reason
from phone_host.jobs.calibrate.board import board_in, unseen_remedy
from phone_host.jobs.calibrate.earlier import (
    Asked,
    Series,
    calibrated,
    every_pair,
    notes,
    require_first_sizes,
    saved_views,
    series_of,
    with_earlier_cameras,
)
from phone_host.jobs.calibrate.other_programs import export_lines, write_exports
from phone_host.jobs.calibrate.request import EXPORTS, CalibrateRequest
from phone_host.jobs.calibrate.rig_file import replace_rig, require_own
from phone_host.jobs.output_folders import (
    announce_other_report,
    claim_names,
    require_file,
    spare_names,
    written_together,
)
from phone_host.jobs.picture_pairs import GivenPictures, given_pictures
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.report_owner import PAGE, REPORT
from phone_host.report.calibration_lines import pairing_notes, passed_over_notes, summary
from phone_host.report.calibration_report import CalibrationReport, Judged
from phone_host.report.calibration_result import calibration_values
from phone_host.report.calibration_shown import series_of_failure, series_of_rig, with_rectified, write_page
from phone_host.run.progress_bar import step_bar, tell
from phone_host.settings import most_pixels
from phone_host.stereo.view_files import ViewFiles, pair_files, passed_over

if TYPE_CHECKING:  # cameras and links: 0.2 s that pictures need not wait for
    from phone_host.jobs.calibrate.live import Live

_NOT_FOUND = frozenset({Reason.NOT_FOUND_LEFT, Reason.NOT_FOUND_RIGHT, Reason.NOT_FOUND_BOTH})


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """What came of the pictures. rig.yaml, report.json and the page are written.

    Attributes:
        report: all of it.
        lines: the summary.
    """

    report: CalibrationReport
    lines: list[str]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Solved:
    """What was made of the views.

    Attributes:
        views: what was found in the pictures.
        seen: all pairs to calibrate from, those of an earlier calibration first, as they were seen.
        pairs: the same as they were used: perhaps without a drift of the cameras.
        found: the rig; or why there is none.
        finding: what is wrong with the series; None: nothing.
    """

    views: BoardViews
    seen: list[BoardPair]
    pairs: list[BoardPair]
    found: Calibration | DataError
    finding: Diagnostic | None = None


def require_rig_place(out: Path) -> None:
    """Refuse an --out that cannot become rig.yaml.

    Raises:
        UnavailableError: it is no file, or one that is not a calibration.
        SettingsError: it has the name of what is written beside it.
    """
    require_file(out)
    spare_names(out, REPORT, PAGE, *EXPORTS)
    require_own(out)


def calibrate_pictures(
    request: CalibrateRequest, asked: Asked, live: "Live | None", may_write: Callable[[], None] = lambda: None
) -> Made:
    """Find the board in all pairs, calibrate, judge and write.

    Args:
        request: of the calibration.
        asked: what it asks for.
        live: the live calibration that took the pictures; None: they lie in the folders that the request names.
        may_write: called when everything is computed; what it raises keeps anything from being written.

    Raises:
        DataError: the pictures cannot be used at all.
        SettingsError: an option contradicts them.
        UnavailableError: a file cannot be read or written.
    """
    mounted, out, limit = request.pictures.mounted, request.out, most_pixels(None, request.pictures.max_megapixels)
    if live is not None:
        given = GivenPictures((str(live.left),), (str(live.right),))
    else:
        given = given_pictures(request.images, out.parent, limit)
        request = replace(request, board_side=request.board_side or given.board_side)  # what the user says counts more
    files = pair_files(given.left, given.right)
    require_first_sizes(files, asked, request)
    announce_other_report(out.parent, "calibrate", tell)
    claim_names(out.parent, out, REPORT, PAGE)
    beside = cameras_beside(files, mounted)
    series, known = series_of(request, asked, lambda named: board_in(files, named, limit))
    with step_bar("finding the board", len(files.pairs)) as step:
        views = look_for_boards(files, series.board, step, limit, mounted)
        solved = solve_series(series, views, request.measured_m, step.say)
    may_write()
    result = judged(files, series, solved, request)
    report = CalibrationReport(
        files=files,
        views=views,
        known=known,
        rejected=views.rejected,
        result=result,
        page=out.with_name(PAGE),
        live=None if live is None else live.last,
    )
    order = [name for name, _, _ in files.pairs]
    taken = Taken(order=order, views=views, pairs=solved.pairs, seen=solved.seen, board=series.board)
    lines = _file_notes(files, given)
    with written_together(out.parent, REPORT, PAGE, command="calibrate") as place:
        if isinstance(result, DataError):
            report = replace(report, earlier_rig=replace_rig(place, out, None, None))
            page, more = series_of_failure(taken, result), []
        else:
            found = result.found
            if beside is not None:
                require_sizes(*beside, views.sizes_px)
            rig = with_cameras(found.rig, None if beside is None else beside[1], mounted)
            rig = replace(with_earlier_cameras(series, rig), verdict=report.verdict)
            kept = saved_views(series, found, solved.seen)
            report = replace(
                report,
                rejected=(*views.rejected, *found.rejected),
                earlier_rig=replace_rig(place, out, rig, found.rectification, kept),
                exported=() if found.rectification is None else write_exports(request, rig, found.rectification),
            )
            page = series_of_rig(taken, result, rig, report.rejected)
            page = with_rectified(page, taken, files, mounted, limit)
            lines += notes(series, list(views.pairs), views.sizes_px)
            more = [
                *export_lines(report.exported, found.rectification),
                *([] if live is None else live.as_lines(request)),
            ]
        write_page(place, page, out.name)
        write_text(place / REPORT, json_text(calibration_values(report), indent=2) + "\n")
    return Made(report, [*lines, known.as_line(), *summary(report, out), *more])


def solve_series(series: Series, views: BoardViews, baseline_m: float, say: Callable[[str], None]) -> Solved:
    """Calibrate, and name what is wrong with the series. If the cameras turned against each other, the rig is that of the last view.

    Args:
        series: the board, and what an earlier calibration gives.
        views: what was found in the pictures.
        baseline_m: the distance of the cameras as the user measured it, m; NaN: not told.
        say: told what is being done.
    """
    seen, sizes_px = list(views.pairs), views.sizes_px
    say("fitting the rig")
    shifted = out_of_step(*views.in_order, series.board, sizes_px)
    if shifted is not None:
        return Solved(views=views, seen=seen, pairs=seen, found=out_of_step_error(shifted))
    try:
        seen = every_pair(series, seen, sizes_px)
    except DataError as failure:
        return Solved(views=views, seen=seen, pairs=seen, found=failure)
    found: Calibration | DataError
    try:
        found = calibrated(series, seen, sizes_px)
    except DataError as failure:
        found = failure
    say("looking for mistakes")
    taken = BoardSeries(
        pairs=tuple(seen), board=series.board, sizes_px=sizes_px, looks=views.looks, baseline_m=baseline_m
    )
    finding = _of_the_new(taken, seen[0 if series.views is None else len(series.views.names) :], found) or name_mistake(
        taken, found
    )
    straight = _straightened(seen, finding)
    try:
        without = calibrated(series, straight, sizes_px) if straight is not seen else found
    except DataError:
        without = found
    if isinstance(found, Calibration) and isinstance(without, Calibration) and len(without.used) < len(found.used):
        without = found  # no better
    pairs = seen if without is found else straight
    return Solved(views=views, seen=seen, pairs=pairs, found=without, finding=finding)


def _of_the_new(taken: BoardSeries, later: list[BoardPair], found: Calibration | DataError) -> Diagnostic | None:
    """Name how the new pictures hang, if most of them do not fit those of an earlier calibration: together, they only look as if of two moments."""
    names = {pair.name for pair in later}
    fit = 0 if isinstance(found, DataError) else sum(used.name in names for used in found.used)
    if len(later) == len(taken.pairs) or 2 * fit > len(later):
        return None
    alone: Calibration | DataError
    try:
        alone = calibrate(later, taken.board, taken.sizes_px)
    except DataError as failure:
        alone = failure
    return placed(replace(taken, pairs=tuple(later)), alone)


def _straightened(pairs: list[BoardPair], finding: Diagnostic | None) -> list[BoardPair]:
    """Return the pairs as the cameras would have seen them had they stood as they do in the last; the same if they did not turn, or this way and that."""
    turned = None if finding is None else finding.evidence.turned
    return pairs if turned is None or turned.course is Course.LOOSE else unturned(pairs, turned)


def judged(files: ViewFiles, series: Series, solved: Solved, request: CalibrateRequest) -> Judged | DataError:
    """Judge a rig; or say why there is none, and what to do."""
    views, found, finding = solved.views, solved.found, solved.finding
    wrong = None if finding is None else finding.evidence.misplaced
    hint = "" if wrong is None else arrangement_hint(views, request.pictures.mounted, wrong, is_live=request.live)
    if isinstance(found, DataError):
        remedy = hint or ("" if finding is None else finding.text) or found.remedy
        if 2 * sum(each.reason in _NOT_FOUND for each in views.rejected) > len(files.pairs):
            remedy = unseen_remedy(files, series.board, most_pixels(None, request.pictures.max_megapixels))
        return DataError(found.problem, remedy)
    judgement = assessed(found, (*views.rejected, *found.rejected), finding, hint)
    if not request.pose_only:  # its lenses come from other views
        judgement = with_corners(judgement, guessed_corners(found, solved.seen, series.board))
    return Judged(found=found, judgement=judgement, finding=finding, hint=hint, measured_m=request.measured_m)


def _file_notes(files: ViewFiles, given: GivenPictures) -> list[str]:
    beside = tuple(path for side in (given.left, given.right) for path in passed_over(side))
    return [*passed_over_notes(beside), *pairing_notes(files)]
