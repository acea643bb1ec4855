"""phone-host scan: put pairs from several places together to one model."""

import argparse
import sys

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED
from common.program.terminal import say
from phone_host.native.library import model_note, native
from phone_host.output.json_text import json_text
from phone_host.report.scan_json import scan_json
from phone_host.report.scan_lines import scan_lines
from phone_host.report.scan_next import next_lines
from phone_host.report.scan_report import ScanReport
from phone_host.run.scan_files import NAMES
from phone_host.run.scan_job import run_scan
from phone_host.verbs.picture_pairs import file_pairs, reading, require_place
from phone_host.verbs.scan.wanted import axes_of, resumed_of, scan_wanted
from phone_host.verbs.stereo_options import require_metres


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
    pairs = file_pairs(options)
    require_place(pairs, NAMES, "scan")
    axes, resumed = axes_of(options, wanted), resumed_of(options)
    with reading(pairs) as watcher:
        return run_scan(pairs, wanted, watcher, axes, resumed)
