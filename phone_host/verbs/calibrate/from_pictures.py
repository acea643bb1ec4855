"""Calibrates from pictures, whoever took them, and writes what came of it: for the command, and for the page."""

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common.errors import DataError, UnavailableError
from common.places import Kind, kind_of
from phone_host.calibration.board_pairs import BoardPair, Calibration, Reason
from phone_host.calibration.board_views import BoardViews, Mounted, look_for_boards
from phone_host.calibration.cameras_beside import cameras_beside, require_sizes, with_cameras
from phone_host.calibration.causes.mistakes import Finding
from phone_host.calibration.causes.name import BoardSeries, name_mistake
from phone_host.calibration.guide.unseen import is_guessed, unseen_in, with_corners
from phone_host.calibration.out_of_step import out_of_step
from phone_host.calibration.series_snapshot import Taken
from phone_host.calibration.target import Board
from phone_host.calibration.verdict import Verdict
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_yaml import is_rig
from phone_host.run.progress_bar import step_bar
from phone_host.settings import most_pixels
from phone_host.stereo.view_files import ViewFiles, pair_files, passed_over
from phone_host.verbs.calibrate.arguments import EXPORTS
from phone_host.verbs.calibrate.board import Known, board_in, unseen_remedy
from phone_host.verbs.calibrate.cause import assessed, calibrated_as_last, cause_report
from phone_host.verbs.calibrate.earlier import (
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
from phone_host.verbs.calibrate.figures import (
    pairing_notes,
    passed_over_notes,
    rejections,
    report_of,
    report_of_failure,
    summary,
    unwritten,
)
from phone_host.verbs.calibrate.hints import arrangement_hint, out_of_step_error
from phone_host.verbs.calibrate.importing import export_lines, write_exports
from phone_host.verbs.calibrate.page import series_of_failure, series_of_rig, with_rectified, write_page
from phone_host.verbs.calibrate.rig_file import replace_rig
from phone_host.verbs.globs import two_lists
from phone_host.verbs.orientation_arguments import orientations
from phone_host.verbs.output_folders import (
    PAGE,
    REPORT,
    claim_names,
    keep_other_report,
    require_file,
    spare_names,
    unwritable,
)
from phone_host.verbs.units import baseline_mm

if TYPE_CHECKING:  # cameras and links: 0.2 s that pictures need not wait for
    from phone_host.verbs.calibrate.live import Live

_NOT_FOUND = frozenset({Reason.NOT_FOUND_LEFT, Reason.NOT_FOUND_RIGHT, Reason.NOT_FOUND_BOTH})


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """What came of the pictures. rig.yaml, report.json and the page are written.

    Attributes:
        verdict: on the rig, or why there is none.
        report: content of report.json.
        lines: the summary.
    """

    verdict: Verdict | DataError
    report: dict[str, Any]
    lines: list[str]


def require_rig_place(out: Path) -> None:
    """Refuse an --out that cannot become rig.yaml.

    Raises:
        UnavailableError: it is no file, or one that is not a calibration.
        SettingsError: it has the name of what is written beside it.
    """
    require_file(out)
    spare_names(out, REPORT, PAGE, *EXPORTS)
    if kind_of(out) is not Kind.MISSING and not is_rig(out):
        raise UnavailableError(f"{out} is not a calibration, and would be replaced", "name another --out")


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
    mounted = orientations(options)
    files = pair_files(*(live.folders if live is not None else two_lists(options.images)))
    require_first_sizes(files, asked, options, mounted)
    keep_other_report(options.out.parent, "calibrate")
    claim_names(options.out.parent, options.out, REPORT, PAGE)
    beside = cameras_beside(files, mounted)
    series, known = series_of(
        options, asked, lambda named: board_in(files, named, most_pixels(None, options.max_megapixels))
    )
    views, found, finding, pairs = _calibrated(files, series, options, mounted)
    may_write()
    wrong = None if finding is None else finding.misplaced
    hint = "" if wrong is None else arrangement_hint(views, mounted, wrong, is_live=options.live)
    if isinstance(found, DataError):
        remedy = hint or ("" if finding is None else f"{finding.sentence}: {finding.remedy}") or found.remedy
        return _report_failure(files, views, known, DataError(found.problem, remedy), options)
    if beside is not None:
        require_sizes(*beside, views.sizes_px)
    rejected = (*views.rejected, *found.rejected)
    judgement = assessed(found, rejected, finding, hint)
    if live is not None and not options.pose_only and is_guessed(found.bends):
        used = {each.name for each in found.used}
        seen = [pair for pair in every_pair(series, pairs) if pair.name in used]
        judgement = with_corners(judgement, unseen_in(seen, series.board, found.rig.left, found.rig.right))
    rig = with_cameras(found.rig, None if beside is None else beside[1], mounted)
    rig = replace(with_earlier_cameras(series, rig), verdict=judgement.verdict)
    report = report_of(files, views, rejected, found, judgement) | known.as_report() | cause_report(finding, hint)
    report |= replace_rig(options.out, rig, found.rectification, saved_views(series, found, pairs))
    report |= {} if live is None else live.as_report()
    exported: list[str] = []
    if found.rectification is not None:
        report |= write_exports(options, rig, found.rectification)
        exported = export_lines(report, found.rectification)
    taken = _taken(files, views, every_pair(series, pairs), series.board)
    page = series_of_rig(taken, found, rig, rejected, report)
    limit = most_pixels(None, options.max_megapixels)
    report |= write_page(options.out, with_rectified(page, taken, files, mounted, limit))
    _write_report(options.out, report)
    said = [*_file_notes(files, options), *notes(series, pairs, views.sizes_px), known.as_line()]
    again = [] if live is None else live.as_lines(options)
    lines = [*said, *summary(report, views, found, rejected, options.out), *exported, *again]
    return Made(judgement.verdict, report, lines)


def _calibrated(
    files: ViewFiles, series: Series, options: argparse.Namespace, mounted: Mounted
) -> tuple[BoardViews, Calibration | DataError, Finding | None, list[BoardPair]]:
    """Search all images and calibrate.

    Returns:
        The views; the calibration, or why there is none; what is wrong with the series; and the pairs as they were used.
    """
    limit, board = most_pixels(None, options.max_megapixels), series.board
    with step_bar("finding the board", len(files.pairs)) as step:
        views = look_for_boards(files, board, step, limit, mounted)
        step.say("fitting the rig")
        shifted = out_of_step(*views.in_order, board, views.sizes_px)
        if shifted is not None:
            return views, out_of_step_error(shifted), None, list(views.pairs)
        found: Calibration | DataError
        pairs = list(views.pairs)
        try:
            found = calibrated(series, pairs, views.sizes_px)
        except DataError as failure:
            found = failure
        step.say("looking for mistakes")
        baseline_m = math.nan if options.baseline is None else baseline_mm(options.baseline) / 1000
        taken = BoardSeries(
            pairs=views.pairs, board=board, sizes_px=views.sizes_px, looks=views.looks, baseline_m=baseline_m
        )
        finding = name_mistake(taken, found)
        if series.rig is not None:  # the earlier pairs stood otherwise, or its lenses are kept
            return views, found, finding, pairs
        return views, *calibrated_as_last(taken, found, finding, series.side)


def _report_failure(
    files: ViewFiles, views: BoardViews, known: Known, failure: DataError, options: argparse.Namespace
) -> Made:
    """Write the report of a calibration that gave no rig."""
    unseen = sum(each.reason in _NOT_FOUND for each in views.rejected)
    error = failure
    if 2 * unseen > len(files.pairs):
        limit = most_pixels(None, options.max_megapixels)
        error = DataError(failure.problem, unseen_remedy(files, known.board, limit))
    report = report_of_failure(files, views, error) | known.as_report() | replace_rig(options.out, None, None)
    report |= write_page(options.out, series_of_failure(_taken(files, views, list(views.pairs), known.board), report))
    _write_report(options.out, report)
    lines = [
        *_file_notes(files, options),
        known.as_line(),
        *rejections(views.rejected),
        *unwritten(report, options.out),
    ]
    return Made(error, report, lines)


def _file_notes(files: ViewFiles, options: argparse.Namespace) -> list[str]:
    given = () if options.live else two_lists(options.images)
    return [*passed_over_notes(tuple(path for side in given for path in passed_over(side))), *pairing_notes(files)]


def _taken(files: ViewFiles, views: BoardViews, pairs: list[BoardPair], board: Board) -> Taken:
    return Taken(order=[name for name, _, _ in files.pairs], views=views, pairs=pairs, board=board)


def _write_report(out: Path, report: dict[str, Any]) -> None:
    try:
        write_text(out.with_name(REPORT), json_text(report, indent=2) + "\n")
    except OSError as error:
        raise unwritable(out.with_name(REPORT), error, beside=out) from error
