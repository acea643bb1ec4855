"""phone-host stereo: compute disparity and point clouds of pairs of image files."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED
from common.program.terminal import say
from phone_host.output.calib_txt import is_calib_txt
from phone_host.output.json_text import json_text
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_lines import pair_lines, set_lines
from phone_host.report.stereo_report import Size
from phone_host.run.stereo_job import NAMES, run_stereo
from phone_host.stereo.core import StereoCore
from phone_host.verbs.picture_pairs import file_pairs, reading, require_place
from phone_host.verbs.stereo.next_commands import Typed, next_commands
from phone_host.verbs.stereo_options import build_core, output_options, overlay_of


def run(options: argparse.Namespace) -> int:
    """Pair the files, compute and write them, and print what came of it."""
    if not options.calibration and not options.rectified:
        raise SettingsError(
            "neither --calibration nor --rectified is given",
            "give the rig.yaml of `phone-host calibrate`, or --rectified --disparities N",
        )
    pairs = file_pairs(options, _core)
    require_place(pairs, NAMES, "stereo")
    commands = partial(next_commands, _typed(options))
    with reading(pairs) as watcher:
        report = run_stereo(pairs, watcher, output_options(options).axes, commands)
    if len(pairs.files.pairs) == 1:
        [only] = report.computed
        _tell(options, pair_json(only), pair_lines(only, str(options.out)))
    else:
        _tell(options, set_json(report), set_lines(report, str(options.out)))
    return 0 if report.is_sound else CHECK_FAILED


def _tell(options: argparse.Namespace, report: dict[str, Any], lines: Sequence[str]) -> None:
    if options.json:
        print(json_text(report))
    else:
        say(lines)


def _core(options: argparse.Namespace, matcher: str, size_px: Size, image: Path) -> StereoCore:
    core, _ = build_core(options, options.calibration or "", matcher, size_px, image)
    assert core is not None, "--calibration and --rectified both make one"
    core.correct(overlay_of(options, core))
    return core


def _typed(options: argparse.Namespace) -> Typed:
    """Return what the user typed, for the pages' commands."""
    is_rig = options.calibration and not is_calib_txt(Path(options.calibration))  # live images are not rectified
    return Typed(
        words=tuple(word for word in sys.argv[1:] if word != "--json") if sys.argv[1:2] == ["stereo"] else (),
        images=tuple(options.images),
        axes=output_options(options).axes,
        rig=options.calibration if is_rig else "",
        folder=Path.cwd(),
    )
