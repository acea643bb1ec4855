"""phone-host calibrate: calibrate two cameras from pictures of a chessboard."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from common.errors import DataError, UnavailableError
from common.places import Kind, kind_of, make_folder
from common.program.terminal import say
from phone_host.calibration.arrangement import Misplaced, is_contradicted, misplaced
from phone_host.calibration.board_pairs import Calibration, Reason
from phone_host.calibration.board_views import BoardViews, Mounted, look_for_boards
from phone_host.calibration.calibrate import calibrate
from phone_host.calibration.cameras_beside import cameras_beside, require_sizes, with_cameras
from phone_host.calibration.out_of_step import out_of_step
from phone_host.calibration.target import Board, parse_board
from phone_host.calibration.verdict import Assessment, Verdict, judge
from phone_host.model import Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_yaml import REJECTED, is_rig, read_rig, write_rig
from phone_host.run.progress_bar import step_bar
from phone_host.settings import most_pixels
from phone_host.stereo.view_files import ViewFiles, pair_files
from phone_host.verbs.calibrate.figures import (
    pairing_notes,
    rejections,
    report_of,
    report_of_failure,
    summary,
    unwritten,
)
from phone_host.verbs.calibrate.hints import arrangement_hint, out_of_step_error
from phone_host.verbs.globs import two_lists
from phone_host.verbs.orientation_arguments import orientations
from phone_host.verbs.output_folders import claim_names, keep_other_report, require_file, unwritable
from phone_host.verbs.units import square_mm

_CHECK_FAILED = 4
_NOT_FOUND = frozenset({Reason.NOT_FOUND_LEFT, Reason.NOT_FOUND_RIGHT, Reason.NOT_FOUND_BOTH})
_COUNT_CORNERS = (
    "check --board: it counts inner corners, one less than the squares each way (10x7 squares are --board 9x6); or take 15 or"
    " more pairs with the whole board sharp in both images"
)


def run(options: argparse.Namespace) -> int:
    """Find the chessboard in all pairs, calibrate, judge and write."""
    board = parse_board(options.board, square_mm(options.square))
    mounted = orientations(options)
    require_file(options.out)
    if kind_of(options.out) is not Kind.MISSING and not is_rig(options.out):
        raise UnavailableError(f"{options.out} is not a calibration, and would be replaced", "name another --out")
    files = pair_files(*two_lists(options.images))
    keep_other_report(options.out.parent, "calibrate")
    claim_names(options.out.parent, options.out, "report.json")
    beside = cameras_beside(files, mounted)
    views, found, wrong = _calibrated(files, board, options, mounted)
    hint = "" if wrong is None else arrangement_hint(views, mounted, wrong)
    if isinstance(found, DataError):
        return _report_failure(files, views, DataError(found.problem, hint or found.remedy), options)
    if beside is not None:
        require_sizes(*beside, views.sizes_px)
    rejected = (*views.rejected, *found.rejected)
    judgement = _advised(judge(found, rejected), found, wrong, hint)
    rig = replace(
        with_cameras(found.rig, None if beside is None else beside[1], mounted), verdict=judgement.verdict.value
    )
    report = report_of(files, views, rejected, found, judgement)
    report |= _write_rig(options.out, replace(found, rig=rig))
    _write_report(options.out, report)
    _tell(options, report, [*pairing_notes(files), *summary(report, views, found, rejected, options.out)])
    return _CHECK_FAILED if judgement.verdict is Verdict.REJECT else 0


def _calibrated(
    files: ViewFiles, board: Board, options: argparse.Namespace, mounted: Mounted
) -> tuple[BoardViews, Calibration | DataError, Misplaced | None]:
    """Search all images and calibrate; return why there is no calibration if there is none, and which side seems turned or mirrored."""
    limit = most_pixels(None, options.max_megapixels)
    with step_bar("finding the board", len(files.pairs)) as step:
        views = look_for_boards(files, board, step, limit, mounted)
        step.say("fitting the rig")
        shifted = out_of_step(*views.in_order, board, views.sizes_px)
        if shifted is not None:
            return views, out_of_step_error(shifted), None
        found: Calibration | DataError
        try:
            found = calibrate(list(views.pairs), board, views.sizes_px, Side(options.board_side))
        except DataError as failure:
            found = failure
        return views, found, misplaced(list(views.pairs), board, views.sizes_px, found)


def _report_failure(files: ViewFiles, views: BoardViews, failure: DataError, options: argparse.Namespace) -> int:
    """Write and print the report of a calibration that gave no rig.

    Raises:
        DataError: always: why there is none.
    """
    unseen = sum(each.reason in _NOT_FOUND for each in views.rejected)
    error = DataError(failure.problem, _COUNT_CORNERS) if 2 * unseen > len(files.pairs) else failure
    report = report_of_failure(files, views, error) | _write_rig(options.out, None)
    _write_report(options.out, report)
    _tell(options, report, [*pairing_notes(files), *rejections(views.rejected), *unwritten(report, options.out)])
    raise error


def _tell(options: argparse.Namespace, report: dict[str, Any], lines: Sequence[str]) -> None:
    if options.json:
        print(json_text(report))
    else:
        say(lines)


def _advised(judgement: Assessment, found: Calibration, wrong: Misplaced | None, hint: str) -> Assessment:
    """Put the side that is turned or mirrored first. A rig of mirrored or unlike views is none, whatever its figures."""
    if wrong is None:
        return judgement
    if found.obstacle is not None or wrong.is_mirrored or is_contradicted(found):
        return Assessment(Verdict.REJECT, (hint,))  # all else follows from it
    return Assessment(judgement.verdict, (hint, *judgement.remedies))


def _write_rig(out: Path, calibration: Calibration | None) -> dict[str, str]:
    """Write rig.yaml. Unless the new rig is of use, move that of an earlier run aside, so that nobody takes the one for the other.

    Returns:
        For the report: where the earlier rig is now, if it was moved.
    """
    rig = None if calibration is None else calibration.rig
    moved: dict[str, str] = {}
    try:
        make_folder(out.parent)
        if (rig is None or rig.verdict == REJECTED) and kind_of(out) is not Kind.MISSING and not _is_rejected(out):
            aside = out.with_name(f"{out.name}.old")
            out.replace(aside)
            moved = {"earlier_rig": aside.name}
        if calibration is not None and calibration.rectification is not None:
            write_rig(out, calibration.rig, calibration.rectification)
        else:
            out.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(out, error) from error
    return moved


def _is_rejected(path: Path) -> bool:
    """Return whether an earlier rig was rejected itself: it may be replaced, and does not take the place of a good one in rig.yaml.old."""
    try:
        return read_rig(path).verdict == REJECTED
    except DataError:
        return False


def _write_report(out: Path, report: dict[str, Any]) -> None:
    try:
        write_text(out.with_name("report.json"), json_text(report, indent=2) + "\n")
    except OSError as error:
        raise unwritable(out, error) from error
