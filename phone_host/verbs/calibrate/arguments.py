"""The options of phone-host calibrate. Light, because every start of the command imports them."""

import argparse
from pathlib import Path
from typing import Final

from common.program.request import add_options
from phone_host.jobs.options import ImageOptions, PairOptions

EXAMPLES = """  phone-host calibrate --live --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --square 25mm --out rig.yaml    # says what to show
  phone-host calibrate left/ right/ --square 25mm --out rig.yaml    # the board's size is found in the pictures
  phone-host calibrate left/ right/ --board 9x6 --square 25mm --out rig.yaml
  phone-host calibrate 'views/left*.png' 'views/right*.png' --board 9x6 --square 25mm --out rig.yaml --json
  phone-host calibrate left/ right/ --board 9x6 --square 25mm --rotate-right 180 --out rig.yaml    # right camera on its head
  phone-host calibrate session.mcap --square 25mm --out rig.yaml    # a recording of both cameras that see the board
  phone-host calibrate more-left/ more-right/ --from rig.yaml --out rig.yaml    # adds pictures to an earlier calibration
  phone-host calibrate left/ right/ --from rig.yaml --pose-only --out rig.yaml    # a camera was moved, its lens is the same
  phone-host calibrate --import camchain.yaml --out rig.yaml    # the calibration of another program; rig.yaml needs no pictures
  phone-host calibrate --import rig.yaml --export ros --export colmap --out rig.yaml    # ros/ and colmap/ beside rig.yaml
"""

EXPORTS: Final = ("ros", "kalibr", "opencv", "opencv-xml", "colmap", "euroc", "middlebury", "kitti")
"""The kinds of `output.rig_files.imported.RigKind` that --export writes. Here, because that module is not light."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="*",
        metavar="LEFT RIGHT",
        help="pictures of the left and of the right camera: two folders or two globs; each left picture is paired with the"
        " right one that has the same number in its name. Pictures are turned upright by their EXIF orientation."
        " Or a recording, FILE.mcap: its stillest pair of each second, at most a hundred, written to views/ beside --out. With --live:"
        " two folders for the pictures it takes (default: views/left and views/right beside --out)",
    )
    _add_live_arguments(parser)
    parser.add_argument(
        "--board",
        metavar="9x6",
        help="inner corners of the chessboard: columns x rows. Without it they are found in the pictures. Boards with marks, of"
        " which a part is enough: charuco:10x8:25mm:18mm:5x5 (squares, their side, a mark's side, ArUco family) or"
        " aprilgrid:6x6:30mm:9mm (tags, their side, the gap)",
    )
    parser.add_argument(
        "--square",
        metavar="25mm",
        help="side of one square: 25mm, 2.5cm or 0.025m; a number alone means mm. Measure it on paper with a ruler; on a"
        " screen it is its pixels times the width of a pixel, such as '120px*0.1794mm'",
    )
    parser.add_argument(
        "--baseline",
        metavar="80mm",
        help="distance of the two lenses, as you measure it with a ruler: it shows whether --square is right",
    )
    parser.add_argument(
        "--from",
        dest="earlier",
        type=Path,
        metavar="rig.yaml",
        help="add these pictures to those of an earlier calibration; --board and --square are then as they were",
    )
    parser.add_argument(
        "--pose-only",
        action="store_true",
        help="with --from: keep its lenses, compute only how the cameras stand to each other, from these pictures alone",
    )
    _add_file_arguments(parser)
    parser.add_argument(
        "--board-side",
        choices=("left", "right"),
        help="which of the two is the board's camera (default left, or as in --from)",
    )
    add_options(parser, ImageOptions)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="rig.yaml",
        help="file for the calibration; report.json and the page index.html are written beside it",
    )


def _add_live_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--live",
        action="store_true",
        help="take the pictures now, from both cameras: says what to show, takes each view by itself, ends when it is enough",
    )
    add_options(parser, PairOptions, "for --live: ")
    parser.add_argument(
        "--views",
        type=int,
        default=25,
        metavar="N",
        help="for --live: take at most so many views, 5 to 99; 3 with --from (default 25)",
    )
    parser.add_argument(
        "--sound",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="for --live: speak, if the system has a speech program, else ring the terminal's bell (default: yes)",
    )
    parser.add_argument(
        "--snapshots",
        type=Path,
        metavar="DIR",
        help="for --live: folder for guide.json and guide.svg, what is shown just now",
    )


def _add_file_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--import",
        dest="imported",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="in place of pictures: a calibration of ROS (left.yaml right.yaml), Kalibr, OpenCV (YAML or XML, one file or two),"
        " COLMAP (cameras.txt images.txt), EuRoC (two sensor.yaml), Middlebury, ETH3D or KITTI (calib.txt), a rig.yaml, or the"
        " folder that holds them; which it is, the content tells",
    )
    parser.add_argument(
        "--unit",
        metavar="1mm",
        help="for --import: what 1 in the file's lengths is, where that is not 1 m, such as 25mm for squares",
    )
    parser.add_argument(
        "--size",
        metavar="WxH",
        help="for --import: size of the images in px where the files do not state it; WxH,WxH if left and right differ",
    )
    parser.add_argument(
        "--export",
        dest="exports",
        action="append",
        choices=EXPORTS,
        default=[],
        metavar="KIND",
        help=f"also write the calibration as files of another program, into a folder KIND beside --out: {', '.join(EXPORTS)};"
        " may be repeated",
    )
