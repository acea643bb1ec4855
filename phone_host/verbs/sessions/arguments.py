"""The options of phone-host sessions. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import frames_per_second, reading, seconds

SUMMARY = "look into recordings, mend, cut and join them, and turn them into folders and back"

EXAMPLES = """  phone-host sessions info session.mcap --out info    # what is inside, gaps, rates; info/index.html shows plots
  phone-host sessions repair broken.mcap --out whole.mcap
  phone-host sessions cut session.mcap --from 10 --to 25 --out part.mcap
  phone-host sessions join board.mcap host.mcap --out joined.mcap    # what a board and a host recorded, each alone
  phone-host sessions join drive-0000*.mcap host.mcap --clock earlier.mcap --out joined.mcap
  phone-host sessions export session.mcap --out folder    # left/, right/, times in ns; as EuRoC and TUM have them
  phone-host sessions import kitti/sequences/00 --out kitti.mcap
  phone-host sessions import MH_01_easy/mav0 --out euroc.mcap
  phone-host sessions import left right --times times.txt --out two.mcap
  phone-host sessions import left right --fps 30 --out two.mcap    # nothing tells their times
  phone-host sessions import bag.mcap --topics /cam0/image_raw /cam1/image_raw --out two.mcap
  phone-host sessions import rosbag2_2026_11_28 --out two.mcap    # also a .bag of ROS 1
"""

UNITS = ("s", "ms", "us", "ns")
TASKS = ("info", "repair", "cut", "join", "export", "import")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("task", choices=TASKS, help="what to do")
    parser.add_argument(
        "paths",
        nargs="+",
        type=Path,
        metavar="FILE.mcap",
        help="the recording; for join, the host's and the board's or all parts of it; for import, a folder or file of another program, or two folders",
    )
    parser.add_argument("--out", type=Path, metavar="PATH", help="the new recording; for export and info, a folder")
    parser.add_argument(
        "--from",
        dest="first",
        type=reading(seconds, "--from"),
        default=0.0,
        metavar="S",
        help="cut: begin S seconds after the first image (default 0)",
    )
    parser.add_argument(
        "--to",
        dest="last",
        type=reading(seconds, "--to"),
        metavar="S",
        help="cut: end S seconds after the first image (default: with the last)",
    )
    parser.add_argument(
        "--clock",
        type=Path,
        metavar="FILE.mcap",
        help="join: another recording of the same host, made over the link since both machines were switched on (default: the host's own)",
    )
    parser.add_argument(
        "--times",
        type=Path,
        metavar="FILE",
        help="import: the times of the images, one a line",
    )
    parser.add_argument(
        "--stamps-in",
        choices=UNITS,
        help="import: the unit of the times in names, tables and --times (default: the one that is plausible)",
    )
    parser.add_argument(
        "--fps",
        type=reading(frames_per_second, "--fps"),
        metavar="N",
        help="import: the images came at N a second, whatever else tells their times",
    )
    parser.add_argument(
        "--topics",
        nargs=2,
        metavar="TOPIC",
        help="import: the topics of the left and of the right images (default: the first two)",
    )
