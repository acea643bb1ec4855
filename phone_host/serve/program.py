"""What the station needs of the commands: it may not import them, so whoever starts it hands them over."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from common.diagnostic import Diagnostic
from common.keys import KeyFolder
from phone_host.calibration.guide.gates import View
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.doctor.camera_check.check import Progress
from phone_host.doctor.host_doctor import Question
from phone_host.live.calibration import LiveCalibration
from phone_host.live.scan import LiveScan
from phone_host.output.axes import Axes
from phone_host.printers.door import PrinterDoor
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted
from phone_host.printers.printer_uri import PrinterUri
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason
from phone_host.run.sinks import Sink
from phone_host.scan.box import Box
from phone_host.stereo.core import StereoCore

Choices = Mapping[str, str]
"""Options of `run`, by name without dashes."""

SinksOf = Callable[[StereoCore | None], Sequence[Sink]]


class Over(Protocol):
    """A run that has ended."""

    @property
    def snapshot(self) -> RunSnapshot:
        """Its last snapshot."""

    @property
    def missing(self) -> str:
        """What could not be written, and why; empty: nothing."""


class ReadyRun(Protocol):
    """A run that is ready to begin."""

    @property
    def host(self) -> Host:
        """Runs, and closes camera and links at its end."""

    def ended(self, ended: EndReason) -> Over:
        """Write the report of a run that has ended."""

    def failed(self, failure: Diagnostic) -> Over:
        """Write the report of a run that an error ended."""


class Shows(Protocol):
    """Takes what a live calibration shows."""

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """Take the present state; called several times a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """What came of a live calibration.

    Attributes:
        words: one sentence.
        rig: the calibration to use from now on; None: it is not fit for use.
        trouble: why not; None: it is.
    """

    words: str
    rig: Path | None
    trouble: Diagnostic | None


class ReadyCalibration(Protocol):
    """A live calibration that is ready to begin."""

    @property
    def live(self) -> LiveCalibration:
        """Takes the views."""

    def run(self, stop: Callable[[], bool], shows: Sequence[Shows]) -> None:
        """Take views until it is enough."""

    def finish(self, may_write: Callable[[], None]) -> Calibrated:
        """Calibrate from the views, and write what came of it.

        Args:
            may_write: raises if nothing shall be written.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Scanned:
    """What came of a scan.

    Attributes:
        words: one sentence.
        level: good, warning or bad.
        folder: where its files lie.
        files: their names.
        snapshot: the last one of the run beneath.
    """

    words: str
    level: str
    folder: Path
    files: tuple[str, ...]
    snapshot: RunSnapshot


class ReadyScan(Protocol):
    """A scan that is ready to begin."""

    @property
    def host(self) -> Host:
        """Runs, and closes camera and links at its end."""

    @property
    def live(self) -> LiveScan:
        """Takes its pairs."""

    def finish(self, ended: EndReason) -> Scanned:
        """Make the surface, and write the files."""

    def save(self) -> Scanned | None:
        """Write what there is after an error; None: there was nothing, or it cannot be written. Raises nothing."""


@dataclass(frozen=True, slots=True)
class PrintWanted:
    """Where and how a scan is printed.

    Attributes:
        text: the printer's address, as the user wrote it; empty: none.
        uri: the same; None: none.
        door: to it; None likewise.
        how: the bed, and how the model is sliced.
        journal: keeps how far it is.
    """

    text: str
    uri: PrinterUri | None
    door: PrinterDoor | None
    how: Wanted
    journal: Journal


class Program(Protocol):
    """What the commands do, for the page."""

    @property
    def keys(self) -> KeyFolder:
        """This machine's key and the boards that it knows."""

    @property
    def feed(self) -> BrowserFeed:
        """What browsers give their cameras to."""

    @property
    def matchers(self) -> tuple[str, ...]:
        """Names that --matcher takes."""

    def kept(self) -> Choices:
        """Return the choices of the settings file."""

    def keep(self, choices: Choices) -> None:
        """Write the choices into the settings file."""

    def changed(self, choices: Choices, changes: Choices) -> Choices:
        """Return choices with some changed, checked as the command line is."""

    def shown(self, choices: Choices) -> Choices:
        """Return the choices as others may see them, without passwords."""

    def command(self, choices: Choices) -> str:
        """Return the command line that does the same, quoted for a shell."""

    def scan_command(self, choices: Choices) -> str:
        """Return the command line of a scan of the same cameras, quoted for a shell; empty: a command cannot do it, or a camera is missing."""

    def run(self, choices: Choices, sinks_of: SinksOf) -> ReadyRun:
        """Open everything that a run needs."""

    def trial(self, choices: Choices, sinks_of: SinksOf) -> ReadyRun:
        """Open everything that a run of some seconds without depth needs."""

    def question(self, choices: Choices) -> Question:
        """Return what the doctor is to look at."""

    def capture(
        self, choices: Choices, stopped: Callable[[], bool], tell: Callable[[Progress], None]
    ) -> Sequence[Diagnostic]:
        """Film for a minute with the own camera, and return what its film is worth; kept beside the chosen calibration.

        Args:
            choices: with a camera.
            stopped: asked often; True ends it.
            tell: called with each frame.
        """

    def calibration(self, choices: Choices, values: Choices, sinks: Sequence[Sink]) -> ReadyCalibration:
        """Open everything that a live calibration needs; the sinks take its pairs."""

    def scan(self, choices: Choices, values: Choices, sinks_of: SinksOf) -> ReadyScan:
        """Open everything that a live scan needs.

        Args:
            choices: of a run, with a calibration.
            values: options of `scan` by name: voxel, box.
            sinks_of: makes further sinks.
        """

    def box(self, values: Choices) -> Box | None:
        """Return the `box` of these options of `scan`; None: there is none.

        Raises:
            SettingsError: it is no box.
        """

    def print_wanted(self, values: Choices) -> PrintWanted:
        """Return how these options of `print`, printer and bed, want a scan printed. Nothing is opened.

        Raises:
            SettingsError: they make no sense.
        """

    def snapshots(self, choices: Choices) -> tuple[Path, Axes]:
        """Return the folder of the snapshots, and the axes of their points."""

    def recordings(self, choices: Choices) -> Path:
        """Return the folder of the recordings that are begun on the page."""
