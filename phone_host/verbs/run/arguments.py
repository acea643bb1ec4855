"""The options of phone-host run. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import milliseconds, reading, seconds
from phone_host.declared_settings import MAX_MEGAPIXELS_HELP
from phone_host.verbs.serve.arguments import add_lan_argument
from phone_host.verbs.source_arguments import add_source_arguments, add_tolerance_argument
from phone_host.verbs.stereo_arguments import add_overlay_argument, add_stereo_arguments

SUMMARY = "pair the board's frames with those of this machine's camera, compute depth, measure every delay"

EXAMPLES = """  phone-host run --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --calibration rig.yaml --out scan
  phone-host run --link ipc://$XDG_RUNTIME_DIR/board --camera replay:right --rectified --disparities 64 --out scan    # photographs, by number
  phone-host run --link tcp://192.168.7.2:5555 --camera 'http://127.0.0.1:8080/video?latency_ms=120' --calibration rig.yaml --out scan
  phone-host run --link serial:/dev/ttyACM0 --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --out scan
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --align-phase    # both cameras expose together
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --budget 30ms    # coarser depth rather than slower
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --serve    # shows the page of this run
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --record session.mcap    # to compute it again later
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --record session.mcap --record-topics depth,cloud    # for other programs
  phone-host run --replay session.mcap --calibration rig.yaml --out again
  phone-host run --replay 'session.mcap?pace=clock' --calibration rig.yaml --fifo 2:drop-newest --out again
  phone-host run --camera 'replay:right?loop=1' --pairs 300 --json    # no depth: pairs and delays only
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    add_source_arguments(parser, waiting="wait for ever; with --seconds S, S + 10 seconds")
    add_stereo_arguments(parser)
    add_overlay_argument(parser)
    parser.add_argument(
        "--no-correction",
        action="store_true",
        help="only tell when the cameras have turned since the calibration; correct nothing",
    )
    _add_pairing(parser)
    _add_ends(parser)
    _add_results(parser)
    parser.add_argument("--max-megapixels", type=int, metavar="N", help=MAX_MEGAPIXELS_HELP)
    parser.add_argument(
        "--log-level",
        choices=("debug", "info", "warning", "error"),
        help="least important messages that are logged to stderr",
    )


def _add_pairing(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--board-side",
        choices=("left", "right"),
        help="which view the board's camera gives (default: as in the calibration, else left)",
    )
    add_tolerance_argument(parser)
    parser.add_argument(
        "--fifo",
        metavar="DEPTH:POLICY",
        help="length of the queue before the matcher, and what happens when it is full: drop-oldest, drop-newest or block (default 1:drop-oldest)",
    )
    parser.add_argument(
        "--budget",
        type=reading(milliseconds, "--budget"),
        metavar="MS",
        help="time for each pair: choose working size, search range and matcher to hold it, and follow when the machine slows down; --scale, --matcher, --disparities and --near stay as given (default: no budget)",
    )
    parser.add_argument(
        "--align-phase",
        nargs="?",
        const="either",
        choices=("either", "board", "host"),
        help="shift the exposure of one camera until both expose together; say which one may be shifted (default either)",
    )
    parser.add_argument(
        "--interpolate",
        action="store_true",
        default=None,
        help="move the board's image along the optical flow to the moment of the other camera's exposure",
    )


def _add_ends(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--pairs",
        type=int,
        metavar="N",
        help="end after N pairs; exit with code 4 if the stream ends before that (default 0: no limit)",
    )
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=0.0,
        metavar="S",
        help="end S seconds after the first pair; exit with code 4 if none comes within 10 seconds more (default: no limit)",
    )


def _add_results(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--record",
        type=Path,
        metavar="FILE.mcap",
        help="keep what both cameras give as it comes, also what finds no partner; any program for ROS 2 recordings reads it",
    )
    parser.add_argument(
        "--record-topics",
        metavar="NAMES",
        help="with --record: also what was computed, at most once a second: depth, cloud, or depth,cloud",
    )
    parser.add_argument(
        "--replay",
        metavar="FILE.mcap[?pace=clock]",
        help="play a recording in place of --link and --camera: every frame with the same partner each time; with pace=clock at the times of then; without --calibration the rig.yaml in it counts",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for delays.jsonl, report.json, index.html and saved pairs"
    )
    parser.add_argument(
        "--save-every",
        type=int,
        default=30,
        metavar="N",
        help="save every Nth pair, beginning with the first; 0 saves none (default 30)",
    )
    parser.add_argument(
        "--serve",
        nargs="?",
        const=True,
        metavar="HOST:PORT",
        help="show the run on a page of this machine (default 127.0.0.1:8765, with --lan 0.0.0.0:8765); phone-host serve does more",
    )
    add_lan_argument(parser, "with --serve: ")
