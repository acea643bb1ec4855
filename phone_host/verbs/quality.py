"""phone-host quality: measure how good a rig's depth is, on pairs of images of a flat wall or board."""

from dataclasses import dataclass
from pathlib import Path

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED
from common.program.request import Request, option, part
from common.program.terminal import columns, say
from common.words import counted
from phone_host.calibration.target.corners import Board, parse_board
from phone_host.jobs.depth import DepthOptions, crop_of
from phone_host.jobs.options import PAIRED, ImageOptions
from phone_host.jobs.picture_pairs import file_pairs, reading, require_place
from phone_host.jobs.units import limit_mm, square_mm
from phone_host.model import Crop
from phone_host.output.json_text import json_text
from phone_host.report.quality_json import quality_json
from phone_host.report.quality_lines import quality_lines
from phone_host.run.quality_job import NAMES, QualityJob, run_quality

EXAMPLES = """  phone-host quality left.png right.png --calibration rig.yaml --distance 1.2m --out quality
  phone-host quality left/ right/ --calibration rig.yaml --board 9x6 --square 25mm --out quality    # the board gives the true distance
  phone-host quality left/ right/ --calibration rig.yaml --distance 500mm,1m,2m --out quality    # one distance for each pair, in name order
  phone-host quality session.mcap --calibration rig.yaml --distance 1.2m --out quality    # a recording of the wall
  phone-host quality left.png right.png --calibration rig.yaml --roi 0,0,640,480 --out quality    # RMS and fill rate alone
"""


def _distances_m(text: str, option: str) -> tuple[float, ...]:
    return tuple(limit_mm(one, option, "1200mm") / 1000 for one in text.split(","))


@dataclass(frozen=True, slots=True, kw_only=True)
class QualityRequest(Request):
    """What quality can be told."""

    images: tuple[str, ...] = option(
        nargs="+",
        metavar="LEFT RIGHT",
        help=f"images of a flat textured wall or of a board: {PAIRED}",
    )
    distances_m: tuple[float, ...] | None = option(
        "--distance",
        read=_distances_m,
        metavar="MM",
        help="true distance of the wall from the left camera, along its optical axis: 1200, 120cm or 1.2m; one for all pairs, or one"
        " for each, with commas between",
    )
    board: str | None = option(
        "--board",
        metavar="9x6",
        help="inner corners of a chessboard that is seen, columns x rows: its corners in the left image give the true plane",
    )
    square_mm: float | None = option(
        "--square",
        read=lambda text, _: square_mm(text),
        metavar="25mm",
        help="side of one of its squares: 25mm, 2.5cm or 0.025m; a number alone means mm",
    )
    roi: Crop | None = option(
        "--roi",
        read=crop_of,
        metavar="X,Y,W,H",
        help="the region that counts, px of the rectified left image (default: the middle 40 %% x 40 %%, or the board inside its"
        " outermost inner corners)",
    )
    depth: DepthOptions = part(DepthOptions, group="depth")
    pictures: ImageOptions = part(ImageOptions, group="pictures")
    out: Path = option(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for report.json and index.html, not that of the images; it is created if it does not exist",
    )


def run(request: QualityRequest) -> int:
    """Pair the files, measure them, and print what came of it."""
    board = _board(request)
    pairs = file_pairs(request.images, request.out, request.depth, request.pictures)
    distances_m, count = request.distances_m or (), len(pairs.files.pairs)
    if len(distances_m) not in {0, 1, count}:
        raise SettingsError(
            f"--distance has {counted(len(distances_m), 'value')}, and there {'is' if count == 1 else 'are'} {counted(count, 'pair')}",
            "give one for all, or one for each in the order of their names, such as 500mm,1m,2m",
        )
    require_place(pairs, NAMES, "quality")
    with reading(pairs) as watcher:
        report = run_quality(QualityJob(pairs=pairs, distances_m=distances_m, board=board, roi=request.roi), watcher)
    if request.as_json:
        print(json_text(quality_json(report)))
    else:
        say(quality_lines(report, str(request.out), columns()))
    return 0 if report.is_sound else CHECK_FAILED


def _board(request: QualityRequest) -> Board | None:
    """Return the board of --board and --square.

    Raises:
        SettingsError: only one of them is given, one is invalid or of a board with marks, or --distance is given, too.
    """
    if request.board is None and request.square_mm is None:
        return None
    if request.board is None or request.square_mm is None:
        raise SettingsError("only one of --board and --square is given", "give both, such as --board 9x6 --square 25mm")
    if request.distances_m is not None:
        raise SettingsError(
            "--distance and --board contradict each other: both give the true distance", "give only one of the two"
        )
    if ":" in request.board:
        raise SettingsError(
            f"--board {request.board!r} has marks, and quality knows chessboards only",
            "show a chessboard and give its inner corners, such as 9x6, or give --distance",
        )
    return parse_board(request.board, request.square_mm)
