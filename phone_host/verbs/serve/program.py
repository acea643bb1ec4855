"""What the commands do, for the page: the page's choices go through the same code as a command line."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import DataError, SettingsError
from common.keys import KeyFolder
from common.program.extensions import registered_names
from common.program.invocation import command_line
from common.program.settings import log_level
from common.stamp import HOST_CLOCK
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.browser_uri import is_browser
from phone_host.camera.factory import open_camera, require_replayed
from phone_host.camera.http_uri import without_password
from phone_host.doctor.camera_check.check import Progress
from phone_host.doctor.capture import check_capture
from phone_host.doctor.host_doctor import Question
from phone_host.jobs.depth import refuse_rejected
from phone_host.jobs.run import PreparedRun, open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.live.calibration import LiveCalibration
from phone_host.live.calibration_view import Shows
from phone_host.model import Verdict
from phone_host.output.axes import Axes
from phone_host.output.calib_txt import is_calib_txt
from phone_host.output.data_folder import data_folder
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.printers.bed import parse_bed
from phone_host.printers.doors import configured_door
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.slicing import SlicingWanted
from phone_host.run.pair_budget import usable_matchers
from phone_host.run.sinks import Sink
from phone_host.scan.box import Box
from phone_host.serve.program import Calibrated, Choices, PrintWanted, SinksOf
from phone_host.settings import chosen_keys, printer_keys
from phone_host.stereo.matcher_names import MATCHERS
from phone_host.verbs.calibrate.earlier import Asked, asked_of
from phone_host.verbs.calibrate.from_pictures import calibrate_pictures, require_rig_place
from phone_host.verbs.calibrate.live import PreparedViews, prepare_views
from phone_host.verbs.serve.choices import (
    calibrate_options,
    placed,
    run_request,
    run_words,
    scan_words,
    shown_words,
    with_changes,
    without_depth,
)
from phone_host.verbs.serve.kept_choices import is_there, keep, kept
from phone_host.verbs.serve.page_scan import PageScan, asked_box, page_scan
from phone_host.verbs.serve.places import page_folder

_TRIAL_S: Final = 2.5
"""Two seconds show the rate of both cameras; a clock is known after less than one."""

_BOARD_S: Final = 4.0
_BROWSER_NS: Final = 10_000_000_000
"""Whoever begins something on the page has started the phone's camera before, or is told to."""

_RIG: Final = Path("rig") / "rig.yaml"
_CAPTURE_S: Final = 60.0
"""So long a phone is watched for growing hot; half a minute tells about its film."""

_OF_DEPTH: Final = ("near", "far", "crop", "scale")
_OF_CALIBRATION: Final = ("board", "square", "baseline", "views")


class Commands:
    """The commands, for the page.

    Args:
        file: the settings file.
        keys: value of --keys; None: not given.
        tell: takes a line that the user should know.

    Raises:
        SettingsError: the settings file is not valid.
    """

    def __init__(self, file: Path, keys: str | None, tell: Callable[[str], None]) -> None:
        self._file, self._tell = file, tell
        self.feed: Final = BrowserFeed(_BROWSER_NS)
        self._kept, others = kept(file)
        self._fixed = [*others, *(("--keys", keys) if keys else ())]
        self.keys: KeyFolder = chosen_keys(file if is_there(file) else None, keys)
        self.matchers: tuple[str, ...] = (*(name.value for name in usable_matchers()), *registered_names(MATCHERS))

    @property
    def log_level(self) -> int:
        """The least important messages that are logged, as the settings file says."""
        return log_level(checked(self._request({})).values.log_level)

    def kept(self) -> Choices:
        """See Program."""
        return self._kept

    def keep(self, choices: Choices) -> None:
        """See Program."""
        keep(self._file, choices, self._kept)
        self._kept = dict(choices)

    def changed(self, choices: Choices, changes: Choices) -> Choices:
        """See Program."""
        shown = self.shown(choices)
        new = with_changes(choices, {name: value for name, value in changes.items() if value != shown.get(name)})
        request = self._request(new)
        checked(request)
        camera = new.get("camera", "")
        if camera and camera != choices.get("camera"):
            require_replayed(camera)
        rig, is_rectified = new.get("calibration"), "rectified" in new
        if idle := [name for name in _OF_DEPTH if changes.get(name) and not (rig or is_rectified)]:
            raise SettingsError(f"--{idle[0]} without a calibration", "calibrate, or name a rig.yaml")
        if rig and changes.get("calibration") and not is_rectified and not is_calib_txt(Path(rig)):
            refuse_rejected(read_own_rig(Path(rig)), rig, allowed=request.depth.use_rejected_rig)
        return new

    def shown(self, choices: Choices) -> Choices:
        """See Program."""
        return {name: without_password(value) if name == "camera" else value for name, value in choices.items()}

    def command(self, choices: Choices) -> str:
        """See Program."""
        return command_line("phone-host", "run", *self._fixed, *shown_words(self.shown(choices)))

    def scan_command(self, choices: Choices) -> str:
        """See Program."""
        if not {"link", "camera"} <= choices.keys() or is_browser(choices["camera"]):
            return ""
        fixed = dict(zip(self._fixed[::2], self._fixed[1::2], strict=True))
        own = {name.removeprefix("--"): value for name, value in fixed.items()}
        out = {"out": str(Path(choices.get("out", "")) / "scan")}
        return command_line("phone-host", "scan", *scan_words({**own, **self.shown(choices), **out}))

    def run(self, choices: Choices, sinks_of: SinksOf) -> PreparedRun:
        """See Program."""
        words = [*self._fixed, *run_words(choices)]
        request = run_request(words)
        opened = open_run(request, checked(request), self._tell, self.feed)
        return opened.prepared(["phone-host", "run", *words], sinks_of(opened.core))

    def trial(self, choices: Choices, sinks_of: SinksOf) -> PreparedRun:
        """See Program."""
        short = {**without_depth(choices), "seconds": str(_TRIAL_S)}
        request = run_request([*self._fixed, *run_words(short), "--wait", str(_BOARD_S)])
        opened = open_run(request, checked(request), lambda _: None, self.feed)
        return opened.prepared((), sinks_of(None))

    def question(self, choices: Choices) -> Question:
        """See Program."""
        request = self._request(choices)
        settings = checked(request).values
        return Question(
            camera=settings.camera,
            links=settings.link,
            calibration="" if request.depth.rectified else settings.calibration,
            out=request.out or data_folder(),
            wait_s=_BOARD_S,
            keys=self.keys,
            data=data_folder(),
            feed=self.feed,
        )

    def capture(
        self, choices: Choices, stopped: Callable[[], bool], tell: Callable[[Progress], None]
    ) -> Sequence[Diagnostic]:
        """See Program."""
        question = self.question(choices)
        camera = open_camera(question.camera, HOST_CLOCK, now.monotonic_ns(), feed=self.feed)
        calibration = Path(question.calibration) if question.calibration else None
        return check_capture(camera, calibration, question.data, _CAPTURE_S, stopped=stopped, tell=tell).findings

    def calibration(self, choices: Choices, values: Choices, sinks: Sequence[Sink]) -> "Calibration":
        """See Program."""
        given = {**without_depth(choices), **{name: values[name] for name in _OF_CALIBRATION if values.get(name)}}
        given.pop("fifo", None)
        words = [word for word in self._fixed if word != "--log-level"]
        for name, value in given.items():
            for each in value.split() if name == "link" else [value]:
                words += [f"--{name}", each]
        out = Path(placed(values.get("out", "")) or data_folder() / _RIG)
        options = calibrate_options(["--live", "--no-sound", *words, "--out", str(out)])
        asked = asked_of(options)
        require_rig_place(out)
        return Calibration(options, asked, prepare_views(options, asked, self.feed, sinks))

    def scan(self, choices: Choices, values: Choices, sinks_of: SinksOf) -> PageScan:
        """See Program."""
        folder = page_folder(choices.get("out"), "scans")
        return page_scan(self._request(choices), values, folder, sinks_of, tell=self._tell, feed=self.feed)

    def box(self, values: Choices) -> Box | None:
        """See Program."""
        return asked_box(values)

    def print_wanted(self, values: Choices) -> PrintWanted:
        """See Program."""
        return asked_print(values, self._file if is_there(self._file) else None)

    def snapshots(self, choices: Choices) -> tuple[Path, Axes]:
        """See Program."""
        return page_folder(choices.get("out"), "snapshots"), Axes(choices.get("axes", Axes.CAMERA.value))

    def recordings(self, choices: Choices) -> Path:
        """See Program."""
        return page_folder(choices.get("out"), "recordings")

    def _request(self, choices: Choices) -> RunRequest:
        return run_request([*self._fixed, *run_words(choices)])


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A live calibration that is ready to begin.

    Attributes:
        options: of `calibrate`.
        asked: what they ask for.
        views: takes the pictures.
    """

    options: argparse.Namespace
    asked: Asked
    views: PreparedViews

    @property
    def live(self) -> LiveCalibration:
        """See ReadyCalibration."""
        return self.views.live

    def run(self, stop: Callable[[], bool], shows: Sequence[Shows]) -> None:
        """See ReadyCalibration."""
        self.views.run(stop, shows)

    def finish(self, may_write: Callable[[], None]) -> Calibrated:
        """See ReadyCalibration."""
        report = calibrate_pictures(self.options, self.asked, self.views.taken(_Nobody()), may_write).report
        if isinstance(report.result, DataError):
            trouble = diagnostic_of(report.result)
            return Calibrated(words=f"no calibration: {trouble.message}", rig=None, trouble=trouble)
        words = f"verdict {report.verdict.value}: {self.options.out}"
        if report.verdict is Verdict.REJECT:
            return Calibrated(
                words=words, rig=None, trouble=Diagnostic("the calibration is rejected", report.remedy, Severity.FAIL)
            )
        return Calibrated(words=words, rig=self.options.out.absolute(), trouble=None)


class _Nobody:
    """Nobody wants the end of it all: the page's stop does not come this far."""

    interrupted = False


def asked_print(values: Choices, file: Path | None) -> PrintWanted:
    """Return how the page wants a scan printed. Nothing is opened.

    Args:
        values: `printer`, which may be missing, and `bed`.
        file: settings file with the keys of servers; None: there is none.

    Raises:
        SettingsError: they make no sense.
    """
    text = values.get("printer", "").strip()
    bed = parse_bed(words) if (words := values.get("bed", "").strip()) else None
    how, journal = Wanted(SlicingWanted(bed)), Journal(data_folder() / "printing")
    if not text:
        return PrintWanted("", None, None, how, journal)
    uri = read_uri(text)
    return PrintWanted(uri.text, uri, configured_door(uri, *printer_keys(file)), how, journal)
