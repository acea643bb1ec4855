"""Calibrates from pictures, whoever took them, and writes what came of it: for the command, and for the page."""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import DataError
from common.program.request import read_request
from phone_host.calibration.guide.unseen import guessed_corners, with_corners
from phone_host.calibration.solve.series_snapshot import Taken
from phone_host.calibration.target.board_views import Mounted, look_for_boards
from phone_host.calibration.target.cameras_beside import cameras_beside, require_sizes, with_cameras
from phone_host.calibration.target.pairs import Reason
from phone_host.jobs.options import ImageOptions
from phone_host.jobs.output_folders import (
    announce_other_report,
    claim_names,
    require_file,
    spare_names,
    written_beside,
)
from phone_host.jobs.picture_pairs import GivenPictures, given_pictures
from phone_host.jobs.units import baseline_mm
from phone_host.model import Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.report_owner import PAGE, REPORT
from phone_host.run.progress_bar import step_bar
from phone_host.settings import most_pixels
from phone_host.stereo.view_files import ViewFiles, pair_files, passed_over
from phone_host.verbs.calibrate.arguments import EXPORTS
from phone_host.verbs.calibrate.board import board_in, unseen_remedy
from phone_host.verbs.calibrate.cause import assessed
from phone_host.verbs.calibrate.earlier import (
    Asked,
    Series,
    notes,
    require_first_sizes,
    saved_views,
    series_of,
    with_earlier_cameras,
)
from phone_host.verbs.calibrate.exporting import export_lines, write_exports
from phone_host.verbs.calibrate.hints import arrangement_hint
from phone_host.verbs.calibrate.page import series_of_failure, series_of_rig, with_rectified, write_page
from phone_host.verbs.calibrate.report import CalibrationReport, Judged
from phone_host.verbs.calibrate.report_json import report_values
from phone_host.verbs.calibrate.rig_file import replace_rig, require_own
from phone_host.verbs.calibrate.solving import Solved, solve_series
from phone_host.verbs.calibrate.summary import pairing_notes, passed_over_notes, summary

if TYPE_CHECKING:  # cameras and links: 0.2 s that pictures need not wait for
    from phone_host.verbs.calibrate.live import Live

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
    options: argparse.Namespace, asked: Asked, live: "Live | None", may_write: Callable[[], None] = lambda: None
) -> Made:
    """Find the board in all pairs, calibrate, judge and write.

    Args:
        options: of `calibrate`.
        asked: what they ask for.
        live: the live calibration that took the pictures; None: they lie in the folders that the options name.
        may_write: called when everything is computed; what it raises keeps anything from being written.

    Raises:
        DataError: the pictures cannot be used at all.
        SettingsError: an option contradicts them.
        UnavailableError: a file cannot be read or written.
    """
    mounted, out = read_request(ImageOptions, vars(options)).mounted, options.out
    if live is not None:
        given = GivenPictures((str(live.left),), (str(live.right),))
    else:
        given = given_pictures(options.images, out.parent, _limit(options))
        options = _with_board_side(options, given.board_side)
    files = pair_files(given.left, given.right)
    require_first_sizes(files, asked, options, mounted)
    announce_other_report(out.parent, "calibrate")
    claim_names(out.parent, out, REPORT, PAGE)
    beside = cameras_beside(files, mounted)
    series, known = series_of(options, asked, lambda named: board_in(files, named, _limit(options)))
    solved = _solved(files, series, options, mounted)
    views = solved.views
    may_write()
    result = _judged(files, series, solved, options, mounted)
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
    with written_beside(out, REPORT, PAGE, command="calibrate") as place:
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
                exported=() if found.rectification is None else write_exports(options, rig, found.rectification),
            )
            page = series_of_rig(taken, result, rig, report.rejected)
            page = with_rectified(page, taken, files, mounted, _limit(options))
            lines += notes(series, list(views.pairs), views.sizes_px)
            more = [
                *export_lines(report.exported, found.rectification),
                *([] if live is None else live.as_lines(options)),
            ]
        write_page(place, page, out.name)
        write_text(place / REPORT, json_text(report_values(report), indent=2) + "\n")
    return Made(report, [*lines, known.as_line(), *summary(report, out), *more])


def _with_board_side(options: argparse.Namespace, told: Side | None) -> argparse.Namespace:
    """Return the options with what a recording tells of the board's side; what the user says counts more."""
    if told is None or options.board_side is not None:
        return options
    return argparse.Namespace(**{**vars(options), "board_side": told.value})


def _limit(options: argparse.Namespace) -> int:
    """Return how many pixels an image may claim."""
    return most_pixels(None, options.max_megapixels)


def _measured_m(options: argparse.Namespace) -> float:
    """Return the baseline as the user measured it, m; NaN: not given."""
    return math.nan if options.baseline is None else baseline_mm(options.baseline) / 1000


def _solved(files: ViewFiles, series: Series, options: argparse.Namespace, mounted: Mounted) -> Solved:
    """Search all images, calibrate, and look for mistakes."""
    with step_bar("finding the board", len(files.pairs)) as step:
        views = look_for_boards(files, series.board, step, _limit(options), mounted)
        return solve_series(series, views, _measured_m(options), step.say)


def _judged(
    files: ViewFiles, series: Series, solved: Solved, options: argparse.Namespace, mounted: Mounted
) -> Judged | DataError:
    """Judge a rig; or say why there is none, and what to do."""
    views, found, finding = solved.views, solved.found, solved.finding
    wrong = None if finding is None else finding.evidence.misplaced
    hint = "" if wrong is None else arrangement_hint(views, mounted, wrong, is_live=options.live)
    if isinstance(found, DataError):
        remedy = hint or ("" if finding is None else finding.text) or found.remedy
        if 2 * sum(each.reason in _NOT_FOUND for each in views.rejected) > len(files.pairs):
            remedy = unseen_remedy(files, series.board, _limit(options))
        return DataError(found.problem, remedy)
    judgement = assessed(found, (*views.rejected, *found.rejected), finding, hint)
    if not options.pose_only:  # its lenses come from other views
        judgement = with_corners(judgement, guessed_corners(found, solved.seen, series.board))
    return Judged(found=found, judgement=judgement, finding=finding, hint=hint, measured_m=_measured_m(options))


def _file_notes(files: ViewFiles, given: GivenPictures) -> list[str]:
    beside = tuple(path for side in (given.left, given.right) for path in passed_over(side))
    return [*passed_over_notes(beside), *pairing_notes(files)]
