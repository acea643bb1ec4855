"""phone-host calibrate: calibrate two cameras from pictures of a board."""

from common.errors import DataError
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.terminal import say
from phone_host.jobs.calibrate.earlier import asked_of
from phone_host.jobs.calibrate.other_programs import import_calibration
from phone_host.jobs.calibrate.pictures import calibrate_pictures, require_rig_place
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.output_folders import require_alone
from phone_host.model import Verdict
from phone_host.output.json_text import json_text
from phone_host.report.calibration_result import calibration_values, import_values

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


def run(request: CalibrateRequest) -> int:
    """Find the board in all pairs, calibrate, judge and write; or import what another program calibrated."""
    if request.imported:
        report, lines = import_calibration(request)
        if request.as_json:
            print(json_text(import_values(report)))
        else:
            say(lines)
        return 0
    request.require_pictures()
    asked = asked_of(request)
    require_rig_place(request.out)
    require_alone(request.out.parent)
    live = signals = None
    if request.live:
        from phone_host.jobs.calibrate.live import take_views  # noqa: PLC0415 - cameras and links: 0.2 s that pictures need not wait for

        live, signals = take_views(request, asked)
    made = calibrate_pictures(request, asked, live)
    if request.as_json:
        print(json_text(calibration_values(made.report)))
    else:
        say(made.lines)
    if isinstance(made.report.result, DataError):
        raise made.report.result
    # Asked only now: Ctrl-C may have come while the rig was computed.
    return exit_code(made.report.verdict, is_interrupted=signals is not None and signals.interrupted)


def exit_code(verdict: Verdict, *, is_interrupted: bool) -> int:
    """Return with what the command ends: a check that failed counts more than a signal."""
    if verdict is Verdict.REJECT:
        return CHECK_FAILED
    return INTERRUPTED if is_interrupted else 0
