"""The options of delay-bench. Light: help must not need OpenCV."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds
from phone_host.stereo.matcher_names import default_words

NEXT_STEPS = """delay-bench measures every delay of each link between board and host. It runs both itself and needs no camera.

a first look, in half a minute:
  delay-bench --links tcp,ipc --size 320x240 --fps 30 --out bench

every kind of link that works here, two sizes, two rates, in three minutes:
  delay-bench --out bench

as over USB, Bluetooth or Wi-Fi, without having them:
  delay-bench --emulate list
  delay-bench --emulate usb-serial,bluetooth,wifi --size 320x240 --quality 50 --fps 10 --out interfaces

a board on another machine, once `phone-host pair` made it known:
  delay-bench --links tcp://192.168.7.2:5555 --seconds 30 --out board

all options:
  delay-bench --help
"""

EXAMPLES = """examples:
  delay-bench --out bench
  delay-bench --links tcp,ipc,serial --size 320x240,640x480 --quality 50,80 --fps 15,30 --seconds 20 --out bench
  delay-bench --emulate usb-serial,bluetooth,wifi --size 320x240 --quality 50 --fps 10 --out interfaces
  delay-bench --links tcp://192.168.7.2:5555 --seconds 30 --json
  delay-bench --size 320x240,640x480 --predict size=1280x720,fps=30 --predict link=bluetooth,processing=4
  delay-bench --replay session.mcap --predict fps=60 --out predicted    # from a recorded run, without running anything
  delay-bench --emulate list

For each link, size, quality and rate, the command runs a board-agent process and the host, and prints the median, 95th and 99th
percentile and maximum of each delay. It leaves the first second of each run out. A board on another machine is measured as it is:
its size, quality and rate cannot be set from here. --out receives delay-bench.json, delay-bench.html (plots, and the queueing model
beside the measurement), delay-bench.svg and trace.json for Perfetto.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--links",
        metavar="NAMES",
        help="tcp, ipc, serial (over a pseudo terminal), rfcomm, or addresses of boards (default: every kind that works here)",
    )
    parser.add_argument("--emulate", metavar="NAMES", help="make links behave like these interfaces; `list` shows them")
    parser.add_argument(
        "--size", default="320x240,640x480", metavar="SIZES", help="image sizes (default 320x240,640x480)"
    )
    parser.add_argument("--quality", default="80", metavar="PERCENTS", help="JPEG qualities (default 80)")
    parser.add_argument("--fps", default="15,30", metavar="RATES", help="frames per second (default 15,30)")
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=4.0,
        metavar="S",
        help="seconds of each run after its warm-up (default 4)",
    )
    parser.add_argument(
        "--predict",
        action="append",
        default=[],
        metavar="CHANGES",
        help="predict the delays of a setting without running it, for example fps=60,size=640x480,kB=40,fifo=4:block,processing=0.5,link=wifi",
    )
    parser.add_argument(
        "--replay",
        type=Path,
        metavar="FILE.mcap",
        help="run nothing: tell the delays of a run that was recorded (`phone-host run --record`), and predict from them",
    )
    parser.add_argument("--matcher", metavar="NAME", help=f"stereo matcher ({default_words()})")
    parser.add_argument(
        "--fifo",
        default="1:drop-oldest",
        metavar="DEPTH:POLICY",
        help="queue before the matcher: drop-oldest, drop-newest or block (default 1:drop-oldest)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for delay-bench.json, delay-bench.html and trace.json"
    )
