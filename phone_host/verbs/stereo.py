"""phone-host stereo: compute disparity and point clouds of pairs of image files."""

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from common.program.commandline import CHECK_FAILED
from common.program.request import Request, option, part
from common.program.terminal import say
from phone_host.jobs.depth import LimitedDepthOptions
from phone_host.jobs.options import PAIRED, ImageOptions
from phone_host.jobs.picture_pairs import file_pairs, reading, require_place
from phone_host.output.calib_txt import is_calib_txt
from phone_host.output.json_text import json_text
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_lines import pair_lines, set_lines
from phone_host.report.stereo_next import Typed, next_commands
from phone_host.run.stereo_job import NAMES, run_stereo

EXAMPLES = """  phone-host stereo left.png right.png --calibration rig.yaml --out scan
  phone-host stereo left/ right/ --calibration rig.yaml --out scans    # folders: a folder scans/pair-NNNNNN per pair
  phone-host stereo 'views/left*.jpg' 'views/right*.jpg' --calibration rig.yaml --out scans
  phone-host stereo im0.png im1.png --rectified --disparities 64 --out scan    # no focal length: no cloud.ply
  phone-host stereo im0.png im1.png --rectified --disparities 80 --focal 994.978 --baseline 193.001 \\
      --doffs 31.086 --center 311.193,254.877 --out scan
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoRequest(Request):
    """What stereo can be told."""

    images: tuple[str, ...] = option(
        nargs="+",
        metavar="LEFT RIGHT",
        help=f"images of the left and of the right camera: {PAIRED}",
    )
    depth: LimitedDepthOptions = part(LimitedDepthOptions, group="depth")
    pictures: ImageOptions = part(ImageOptions, group="pictures")
    out: Path = option(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for the results, not that of the images; it is created if it does not exist. Several pairs get a folder"
        " DIR/pair-NNNNNN each, with the number in their names",
    )


def run(request: StereoRequest) -> int:
    """Pair the files, compute and write them, and print what came of it."""
    pairs = file_pairs(request.images, request.out, request.depth, request.pictures, needs_metres=False)
    require_place(pairs, NAMES, "stereo")
    with reading(pairs) as watcher:
        report = run_stereo(pairs, watcher, request.depth.axes, partial(next_commands, _typed(request)))
    is_one, out = len(pairs.files.pairs) == 1, str(request.out)
    if request.as_json:
        print(json_text(pair_json(report.computed[0]) if is_one else set_json(report)))
    else:
        say(pair_lines(report.computed[0], out) if is_one else set_lines(report, out))
    return 0 if report.is_sound else CHECK_FAILED


def _typed(request: StereoRequest) -> Typed:
    """Return what the user typed, for the pages' commands."""
    calibration = request.depth.calibration or ""
    is_rig = calibration and not is_calib_txt(Path(calibration))  # live images are not rectified
    return Typed(
        words=tuple(word for word in sys.argv[1:] if word != "--json") if sys.argv[1:2] == ["stereo"] else (),
        images=request.images,
        axes=request.depth.axes,
        rig=calibration if is_rig else "",
        folder=Path.cwd(),
    )
