"""phone-host calibrate: calibrate two cameras from pictures of a board."""

import argparse

from common.errors import DataError
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.terminal import say
from phone_host.jobs.output_folders import require_alone
from phone_host.model import Verdict
from phone_host.output.json_text import json_text
from phone_host.verbs.calibrate.earlier import asked_of
from phone_host.verbs.calibrate.from_pictures import calibrate_pictures, require_rig_place
from phone_host.verbs.calibrate.given import require_pictures
from phone_host.verbs.calibrate.importing import import_calibration
from phone_host.verbs.calibrate.report_json import report_values


def run(options: argparse.Namespace) -> int:
    """Find the board in all pairs, calibrate, judge and write; or import what another program calibrated."""
    if options.imported:
        return import_calibration(options)
    require_pictures(options)
    asked = asked_of(options)
    require_rig_place(options.out)
    require_alone(options.out.parent)
    live = None
    if options.live:
        from phone_host.verbs.calibrate.live import take_views  # noqa: PLC0415 - cameras and links: 0.2 s that pictures need not wait for

        live = take_views(options, asked)
    made = calibrate_pictures(options, asked, live)
    if options.json:
        print(json_text(report_values(made.report)))
    else:
        say(made.lines)
    if isinstance(made.report.result, DataError):
        raise made.report.result
    # Asked only now: Ctrl-C may have come while the rig was computed.
    return exit_code(made.report.verdict, is_interrupted=live is not None and live.signals.interrupted)


def exit_code(verdict: Verdict, *, is_interrupted: bool) -> int:
    """Return with what the command ends: a check that failed counts more than a signal."""
    if verdict is Verdict.REJECT:
        return CHECK_FAILED
    return INTERRUPTED if is_interrupted else 0
