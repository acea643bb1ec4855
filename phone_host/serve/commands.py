"""What is chosen on the page, and the jobs that it begins: choices go through the same code as a command line."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
from phone_host.camera.factory import open_camera, require_replayed
from phone_host.camera.uris import is_browser, without_password
from phone_host.doctor.camera_check.check import Progress
from phone_host.doctor.capture import check_capture
from phone_host.doctor.host_doctor import Question
from phone_host.jobs.calibrate.earlier import Asked, asked_of
from phone_host.jobs.calibrate.live import PreparedViews, prepare_views
from phone_host.jobs.calibrate.pictures import calibrate_pictures, require_rig_place
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.run import PreparedRun, open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.jobs.scan import PreparedScan, SinksOf, open_metric_run, prepare_scan
from phone_host.jobs.scan_request import ScanRequest, axes_beside
from phone_host.jobs.stereo_core import refuse_rejected
from phone_host.model import Verdict
from phone_host.output.axes import Axes
from phone_host.output.calib_txt import is_calib_txt
from phone_host.output.data_folder import data_folder
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.run.pair_budget import usable_matchers
from phone_host.run.sinks import Sink
from phone_host.serve.choices import (
    Choices,
    asked_scan,
    calibrate_options,
    placed,
    request_of,
    shown_words,
    with_changes,
    without_depth,
    words_of,
)
from phone_host.serve.kept_choices import is_there, keep, load_choices
from phone_host.serve.saved import new_place, page_folder
from phone_host.serve.workshop import PrintWanted, asked_print
from phone_host.settings import chosen_keys
from phone_host.stereo.matcher_names import MATCHERS

_TRIAL_S: Final = 2.5
"""Two seconds show the rate of both cameras; a clock is known after less than one."""

_BOARD_S: Final = 4.0
_BROWSER_NS: Final = 10_000_000_000
"""Whoever begins something on the page has started the phone's camera before, or is told to."""

_CAPTURE_S: Final = 60.0
"""So long a phone is watched for growing hot; half a minute tells about its film."""

_RIG: Final = Path("rig") / "rig.yaml"
_OF_DEPTH: Final = ("near", "far", "crop", "scale")


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What came of a live calibration.

    Attributes:
        words: one sentence.
        trouble: why there is no rig of use; None: there is.
        rig: the calibration to use from now on; None: it is not fit for use.
    """

    words: str
    trouble: Diagnostic | None = None
    rig: Path | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A live calibration that is ready to begin.

    Attributes:
        request: what is asked for.
        asked: what it says of the board and of an earlier calibration.
        views: takes the pictures.
    """

    request: CalibrateRequest
    asked: Asked
    views: PreparedViews

    def finish(self, may_write: Callable[[], None]) -> Calibrated:
        """Calibrate from the views, and write what came of it.

        Args:
            may_write: raises if nothing shall be written.
        """
        out = self.request.out
        report = calibrate_pictures(self.request, self.asked, self.views.taken(), may_write).report
        if isinstance(report.result, DataError):
            trouble = diagnostic_of(report.result)
            return Calibrated(f"no calibration: {trouble.message}", trouble)
        words = f"verdict {report.verdict.value}: {out}"
        if report.verdict is Verdict.REJECT:
            return Calibrated(words, Diagnostic("the calibration is rejected", report.remedy, Severity.FAIL))
        return Calibrated(words, rig=out.absolute())


class Commands:
    """The page's choices, which are options of `phone-host run`, and the jobs that are opened with them.

    Attributes:
        feed: what browsers give their cameras to.
        kept: the choices of the settings file.
        keys: this machine's key and the boards that it knows.
        matchers: names that --matcher takes.

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
        self.kept, others = load_choices(file)
        self._fixed = {**others, **({"keys": keys} if keys else {})}
        self.keys: KeyFolder = chosen_keys(file if is_there(file) else None, keys)
        self.matchers: tuple[str, ...] = (*(name.value for name in usable_matchers()), *registered_names(MATCHERS))

    @property
    def log_level(self) -> int:
        """The least important messages that are logged, as the settings file says."""
        return log_level(checked(self._request({})).values.log_level)

    def keep(self, choices: Choices) -> None:
        """Write the choices into the settings file."""
        keep(self._file, choices, self.kept)
        self.kept = dict(choices)

    def changed(self, choices: Choices, changes: Choices) -> Choices:
        """Return choices with some changed, checked as the command line is.

        Raises:
            SettingsError: one of them is invalid, or without effect.
            DataError: the rig cannot be used.
        """
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
        """Return the choices as others may see them, without passwords."""
        return {name: without_password(value) if name == "camera" else value for name, value in choices.items()}

    def command(self, choices: Choices) -> str:
        """Return the command line that does the same, quoted for a shell."""
        return command_line("phone-host", "run", *shown_words({**self._fixed, **self.shown(choices)}))

    def scan_command(self, choices: Choices) -> str:
        """Return the command line of a scan of the same cameras, quoted for a shell; empty: a command cannot do it, or a camera is missing."""
        if not {"link", "camera"} <= choices.keys() or is_browser(choices["camera"]):
            return ""
        own = {**self._fixed, **self.shown(choices), "out": str(Path(choices.get("out", "")) / "scan")}
        return command_line("phone-host", "scan", *words_of(own, ScanRequest))

    def run(self, choices: Choices, sinks_of: SinksOf) -> PreparedRun:
        """Open everything that a run needs."""
        request = self._request(choices)
        opened = open_run(request, checked(request), self._tell, self.feed)
        return opened.prepared(words_of({**self._fixed, **choices}), sinks_of(opened.core))

    def trial(self, choices: Choices, sinks_of: SinksOf) -> PreparedRun:
        """Open everything that a run of some seconds without depth needs."""
        request = self._request({**without_depth(choices), "seconds": str(_TRIAL_S), "wait": str(_BOARD_S)})
        opened = open_run(request, checked(request), lambda _: None, self.feed)
        return opened.prepared((), sinks_of(None))

    def scan(self, choices: Choices, values: Choices, sinks_of: SinksOf) -> PreparedScan:
        """Open everything that a scan needs.

        Args:
            choices: of a run, with a calibration.
            values: options of `scan` by name; see `asked_scan`.
            sinks_of: makes further sinks.
        """
        own = {name: value for name, value in choices.items() if name != "out"}  # the run beneath writes nothing itself
        request = self._request({**own, "save-every": "0"})
        found = checked(request)
        if not found.values.calibration and not (request.depth.rectified and request.depth.focal_px):
            raise SettingsError("there is no calibration, so there are no metres", "calibrate, or name a rig.yaml")
        wanted = asked_scan(values)
        axes, out = axes_beside(request.depth.axes, wanted), new_place(page_folder(choices.get("out"), "scans"))
        opened = open_metric_run(request, found, self._tell, self.feed)
        return prepare_scan(opened, found, wanted, axes, out, tell=self._tell, sinks_of=sinks_of)

    def question(self, choices: Choices) -> Question:
        """Return what the doctor is to look at."""
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
        """Film for a minute with the own camera, and return what its film is worth; kept beside the chosen calibration.

        Args:
            choices: with a camera.
            stopped: asked often; True ends it.
            tell: called with each frame.
        """
        question = self.question(choices)
        camera = open_camera(question.camera, HOST_CLOCK, now.monotonic_ns(), feed=self.feed)
        calibration = Path(question.calibration) if question.calibration else None
        return check_capture(camera, calibration, question.data, _CAPTURE_S, stopped=stopped, tell=tell).findings

    def calibration(self, choices: Choices, values: Choices, sinks: Sequence[Sink]) -> Calibration:
        """Open everything that a live calibration needs.

        Args:
            choices: of a run.
            values: options of `calibrate` by name.
            sinks: take its pairs.
        """
        given = {name: value for name, value in without_depth(choices).items() if name != "fifo"}
        given |= {name: values[name] for name in calibrate_options() if values.get(name)}
        given |= {name: value for name, value in self._fixed.items() if name == "keys"}
        given |= {"live": "yes", "out": placed(values.get("out", "")) or str(data_folder() / _RIG)}
        request = replace(request_of(given, CalibrateRequest, "calibrate"), sound=False)
        asked = asked_of(request)
        require_rig_place(request.out)
        return Calibration(request, asked, prepare_views(request, asked, self.feed, sinks))

    def print_wanted(self, values: Choices) -> PrintWanted:
        """Return how these options of `print`, printer and bed, want a scan printed. Nothing is opened."""
        return asked_print(values, self._file if is_there(self._file) else None)

    def snapshots(self, choices: Choices) -> tuple[Path, Axes]:
        """Return the folder of the snapshots, and the axes of their points."""
        return page_folder(choices.get("out"), "snapshots"), Axes(choices.get("axes", Axes.CAMERA.value))

    def _request(self, choices: Choices) -> RunRequest:
        return request_of({**self._fixed, **choices}, RunRequest)
