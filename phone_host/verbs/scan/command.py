"""phone-host scan: put pairs from several places together to one model."""

import argparse
import sys

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED
from common.program.terminal import say
from phone_host.output.json_text import json_text
from phone_host.report.scan_json import scan_json
from phone_host.report.scan_lines import scan_lines
from phone_host.report.scan_next import next_lines
from phone_host.report.scan_report import ScanReport
from phone_host.run.progress_bar import step_bar
from phone_host.run.scan_files import NAMES
from phone_host.run.scan_job import ScanJob, run_scan
from phone_host.settings import most_pixels
from phone_host.stereo.default_matcher import default_matcher, default_note
from phone_host.stereo.native.library import model_note, native
from phone_host.stereo.view_files import pair_files
from phone_host.verbs.given_pictures import given_pictures
from phone_host.verbs.orientation_arguments import orientations
from phone_host.verbs.output_folders import unwritable
from phone_host.verbs.result_places import require_place
from phone_host.verbs.scan.wanted import axes_of, resumed_of, scan_wanted
from phone_host.verbs.stereo_options import metric_core, require_metres


def run(options: argparse.Namespace) -> int:
    """Scan pictures, or what two cameras give, and print what came of it."""
    if note := model_note(native()):
        say(f"phone-host: {note}", sys.stderr)
    if options.images:
        report, code = _scan_pictures(options), 0
    else:
        from phone_host.verbs.scan.live import scan_live  # noqa: PLC0415 - pictures need neither links nor cameras

        report, code = scan_live(options)
    if options.json:
        print(json_text(scan_json(report)))
    else:
        say([*scan_lines(report, str(options.out)), *next_lines(report, options.out)])
    return code or (0 if report.is_sound else CHECK_FAILED)


def _scan_pictures(options: argparse.Namespace) -> ScanReport:
    """Pair the files and scan them."""
    for name in ("camera", "link", "replay", "record", "pairs", "seconds"):
        if getattr(options, name) != (0.0 if name == "seconds" else None):
            raise SettingsError(f"--{name} beside pictures", "give either pictures or cameras")
    require_metres(options)
    wanted = scan_wanted(options)
    matcher = options.matcher or default_matcher().value
    limit = most_pixels(None, options.max_megapixels)
    given = given_pictures(options.images, options.out, limit)
    files = pair_files(given.left, given.right)
    require_place(options.out, files, NAMES, "scan")
    job = ScanJob(
        files=files,
        out=options.out,
        make_core=lambda size_px: metric_core(options, matcher, size_px, files.pairs[0][1]),
        matcher=matcher,
        matcher_note="" if options.matcher else default_note(),
        wanted=wanted,
        axes=axes_of(options, wanted),
        most_pixels=limit,
        mounted=orientations(options),
        resumed=resumed_of(options),
        tell=lambda line: say(f"phone-host: {line}", sys.stderr, flush=True),
    )
    try:
        with step_bar("reading", len(files.pairs)) as watcher:
            return run_scan(job, watcher)
    except OSError as error:
        raise unwritable(options.out, error) from error
