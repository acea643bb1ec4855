"""phone-host calibrate: calibrate two cameras from pictures of a chessboard."""

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from common.errors import DataError, UnavailableError
from common.program.terminal import fitted
from phone_host.calibration.board_pairs import Calibration, Reason
from phone_host.calibration.board_views import BoardViews, Mounted, look_for_boards
from phone_host.calibration.calibrate import calibrate
from phone_host.calibration.cameras_beside import cameras_beside, require_sizes, with_cameras
from phone_host.calibration.target import Board, parse_board
from phone_host.calibration.verdict import Assessment, Verdict, judge
from phone_host.model import Rig, Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_yaml import REJECTED, is_rig, read_rig, write_rig
from phone_host.run.progress_bar import step_bar
from phone_host.settings import most_pixels
from phone_host.stereo.view_files import ViewFiles, pair_files
from phone_host.verbs.calibrate.figures import rejections, report_of, report_of_failure, summary, unwritten
from phone_host.verbs.globs import two_lists
from phone_host.verbs.orientation_arguments import orientations
from phone_host.verbs.output_folders import claim_names, keep_other_report, require_file, unwritable
from phone_host.verbs.units import square_mm

_CHECK_FAILED = 4
_ROLLED_DEG = 45.0
"""Nearer to a quarter turn than to none."""

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
    if options.out.exists() and not is_rig(options.out):
        raise UnavailableError(f"{options.out} is not a calibration, and would be replaced", "name another --out")
    files = pair_files(*two_lists(options.images))
    keep_other_report(options.out.parent, "calibrate")
    claim_names(options.out.parent, options.out, "report.json")
    beside = cameras_beside(files, mounted)
    views, found = _calibrated(files, board, options, mounted)
    if isinstance(found, DataError):
        return _report_failure(files, views, found, options)
    if beside is not None:
        require_sizes(*beside, views.sizes_px)
    rejected = (*views.rejected, *found.rejected)
    judgement = judge(found, rejected)
    if (hint := _turn_hint(views, found.rig)) is not None:
        judgement = Assessment(judgement.verdict, (hint, *judgement.remedies))
    rig = replace(
        with_cameras(found.rig, None if beside is None else beside[1], mounted), verdict=judgement.verdict.value
    )
    report = report_of(files, views, rejected, found, judgement)
    report |= _write_rig(options.out, replace(found, rig=rig))
    _write_report(options.out, report)
    print(json_text(report) if options.json else fitted(summary(report, views, found, rejected, options.out)))
    return _CHECK_FAILED if judgement.verdict is Verdict.REJECT else 0


def _calibrated(
    files: ViewFiles, board: Board, options: argparse.Namespace, mounted: Mounted
) -> tuple[BoardViews, Calibration | DataError]:
    """Search all images and calibrate; return why there is no calibration if there is none."""
    limit = most_pixels(None, options.max_megapixels)
    with step_bar("finding the board", len(files.pairs)) as step:
        views = look_for_boards(files, board, step, limit, mounted)
        step.say("fitting the rig")
        try:
            return views, calibrate(list(views.pairs), board, views.sizes_px, Side(options.board_side))
        except DataError as failure:
            return views, failure


def _report_failure(files: ViewFiles, views: BoardViews, failure: DataError, options: argparse.Namespace) -> int:
    """Write and print the report of a calibration that gave no rig.

    Raises:
        DataError: always: why there is none.
    """
    unseen = sum(each.reason in _NOT_FOUND for each in views.rejected)
    error = DataError(failure.problem, _COUNT_CORNERS) if 2 * unseen > len(files.pairs) else failure
    report = report_of_failure(files, views, error) | _write_rig(options.out, None)
    _write_report(options.out, report)
    text = "\n".join([rejections(views.rejected), *unwritten(report, options.out)])
    print(json_text(report) if options.json else fitted(text))
    raise error


def _turn_hint(views: BoardViews, rig: Rig) -> str | None:
    """Say that two EXIF headers disagree where the cameras seem rolled against each other; None otherwise."""
    if views.turned[0] == views.turned[1]:
        return None
    roll_deg = math.degrees(math.atan2(rig.R_right_left[1, 0], rig.R_right_left[0, 0]))
    if abs(roll_deg) < _ROLLED_DEG:
        return None
    by_deg = round(roll_deg / 90) * 90 % 360
    return (
        f"left and right EXIF headers differ, and the right camera appears turned by {abs(roll_deg):.0f} degrees: if both cameras"
        f" are mounted alike, add --rotate-right {360 - by_deg}, or remove that tag from all images"
    )


def _write_rig(out: Path, calibration: Calibration | None) -> dict[str, str]:
    """Write rig.yaml. Unless the new rig is of use, move that of an earlier run aside, so that nobody takes the one for the other.

    Returns:
        For the report: where the earlier rig is now, if it was moved.
    """
    rig = None if calibration is None else calibration.rig
    moved: dict[str, str] = {}
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if (rig is None or rig.verdict == REJECTED) and out.exists() and not _is_rejected(out):
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
