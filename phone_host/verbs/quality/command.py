"""phone-host quality: measure how good a rig's depth is, on pairs of images of a flat wall or board."""

import argparse

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED
from common.program.terminal import columns, say
from common.words import counted
from phone_host.calibration.target.corners import Board, parse_board
from phone_host.jobs.depth import crop_of
from phone_host.jobs.units import limit_mm, square_mm
from phone_host.output.json_text import json_text
from phone_host.report.quality_json import quality_json
from phone_host.report.quality_lines import quality_lines
from phone_host.run.quality_job import NAMES, QualityJob, run_quality
from phone_host.stereo.view_files import ViewFiles
from phone_host.verbs.picture_pairs import file_pairs, reading, require_place
from phone_host.verbs.stereo_options import require_metres


def run(options: argparse.Namespace) -> int:
    """Pair the files, measure them, and print what came of it."""
    require_metres(options)
    board = _board(options)
    roi = None if options.roi is None else crop_of(options.roi, "--roi")
    pairs = file_pairs(options)
    distances_m = _distances_m(options, pairs.files)
    require_place(pairs, NAMES, "quality")
    with reading(pairs) as watcher:
        report = run_quality(QualityJob(pairs=pairs, distances_m=distances_m, board=board, roi=roi), watcher)
    if options.json:
        print(json_text(quality_json(report)))
    else:
        say(quality_lines(report, str(options.out), columns()))
    return 0 if report.is_sound else CHECK_FAILED


def _board(options: argparse.Namespace) -> Board | None:
    """Read --board and --square.

    Raises:
        SettingsError: only one of them is given, one is invalid or of a board with marks, or --distance is given, too.
    """
    if options.board is None and options.square is None:
        return None
    if options.board is None or options.square is None:
        raise SettingsError("only one of --board and --square is given", "give both, such as --board 9x6 --square 25mm")
    if options.distance is not None:
        raise SettingsError(
            "--distance and --board contradict each other: both give the true distance", "give only one of the two"
        )
    if ":" in options.board:
        raise SettingsError(
            f"--board {options.board!r} has marks, and quality knows chessboards only",
            "show a chessboard and give its inner corners, such as 9x6, or give --distance",
        )
    return parse_board(options.board, square_mm(options.square))


def _distances_m(options: argparse.Namespace, files: ViewFiles) -> tuple[float, ...]:
    """Read --distance: nothing, one for all pairs, or one for each.

    Raises:
        SettingsError: one is invalid, or there are neither one nor as many as pairs.
    """
    if options.distance is None:
        return ()
    found = tuple(limit_mm(one, "--distance", "1200mm") / 1000 for one in options.distance.split(","))
    if len(found) not in {1, len(files.pairs)}:
        raise SettingsError(
            f"--distance has {counted(len(found), 'value')}, and there {'is' if len(files.pairs) == 1 else 'are'} {counted(len(files.pairs), 'pair')}",
            "give one for all, or one for each in the order of their names, such as 500mm,1m,2m",
        )
    return found
