"""phone-host scan: put pairs from several places together to one model."""

import sys
from typing import TYPE_CHECKING

from common.errors import SettingsError
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.signals import StopSignals
from common.program.terminal import say
from phone_host.jobs.picture_pairs import file_pairs, reading, require_place
from phone_host.jobs.scan_request import ScanRequest, axes_beside, model_wanted, resumed_of
from phone_host.native.library import model_note, native
from phone_host.output.json_text import json_text
from phone_host.report.scan_json import scan_json
from phone_host.report.scan_lines import scan_lines
from phone_host.report.scan_next import next_lines
from phone_host.report.scan_report import ScanReport
from phone_host.run.host_settings import EndReason
from phone_host.run.scan_job import NAMES, run_scan

if TYPE_CHECKING:
    from phone_host.jobs.scan import PreparedScan

EXAMPLES = """  phone-host scan left/ right/ --calibration rig.yaml --out cup    # folders: photographs on the way around the cup
  phone-host scan left/ right/ --calibration rig.yaml --voxel 2mm --far 80cm --out cup    # finer, and without the background
  phone-host scan left/ right/ --calibration rig.yaml --box 400x300x400@0,100,900 --out cup    # only what is in this box
  phone-host scan left/ right/ --calibration rig.yaml --mat --out cup    # on the sheet of `phone-host target mat`, any way around
  phone-host scan left/ right/ --calibration rig.yaml --object --out cup    # what stands on a table, without a mat
  phone-host scan left/ right/ --rectified --focal 525 --baseline 60 --out room
  phone-host scan --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --record cup.mcap --out cup    # live
  phone-host scan left/ right/ --calibration rig.yaml --turntable --out cup    # the cup was turned, the cameras stood still
  phone-host scan left2/ right2/ --calibration rig.yaml --turntable --onto cup --out whole    # turned over: its underside, too
  phone-host scan left/ right/ --calibration rig.yaml --resume cup --out cup    # go on after it was killed
  phone-host scan --replay session.mcap --calibration rig.yaml --out cup    # every pair of a recording
"""


def run(request: ScanRequest) -> int:
    """Scan pictures, or what two cameras give, and print what came of it."""
    if note := model_note(native()):
        _tell(note)
    report, code = (_scan_pictures(request), 0) if request.images else _scan_live(request)
    if request.as_json:
        print(json_text(scan_json(report)))
    else:
        say([*scan_lines(report, str(request.out)), *next_lines(report, request.out)])
    return code or (0 if report.is_sound else CHECK_FAILED)


def _scan_pictures(request: ScanRequest) -> ScanReport:
    """Pair the files and scan them."""
    for name in ("camera", "link", "replay", "record", "pairs", "seconds"):
        if request.given[name] != (0.0 if name == "seconds" else None):
            raise SettingsError(f"--{name} beside pictures", "give either pictures or cameras")
    wanted = model_wanted(request.model, request.out)
    pairs = file_pairs(request.images, request.out, request.depth, request.pictures)
    require_place(pairs, NAMES, "scan")
    axes, resumed = axes_beside(request.depth.axes, wanted), resumed_of(request, _tell)
    with reading(pairs) as watcher:
        return run_scan(pairs, wanted, watcher, axes, resumed)


def _scan_live(request: ScanRequest) -> tuple[ScanReport, int]:
    """Scan until stopped, until the number of pairs is reached, or until a stream ends; return the report, and the exit code of a sound model."""
    from phone_host.jobs.scan import open_scan  # noqa: PLC0415 - pictures need neither links nor cameras

    scan, signals = open_scan(request, sys.argv, _tell)
    try:
        ended = _followed(scan, signals)
    except BaseException:
        scan.failed()
        raise
    report, _ = scan.ended(ended)
    too_few = request.pairs and ended is EndReason.STREAM_ENDED
    return report, INTERRUPTED if signals.interrupted else CHECK_FAILED if too_few else 0


def _followed(scan: "PreparedScan", signals: StopSignals) -> EndReason:
    """Run, and tell whoever holds the cameras what helps: beside the surface on a terminal, else a line when it changes."""
    live = scan.live
    if sys.stderr.isatty():
        from phone_host.run.scan_view import ScanPicture  # noqa: PLC0415 - likewise

        with ScanPicture(live) as picture:
            ended = scan.host.run(lambda: signals.stop, picture.refresh)
            picture.end()
            return ended
    told = ""

    def tell() -> None:
        nonlocal told
        advice = live.words.partition(": ")[2]
        if advice != told:
            _tell(live.words)
        told = advice

    ended = scan.host.run(lambda: signals.stop, tell)
    live.end()
    _tell(live.words)
    return ended


def _tell(line: str) -> None:
    say(f"phone-host: {line}", sys.stderr)
