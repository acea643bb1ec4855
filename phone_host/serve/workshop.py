"""The last scan as a thing: checked, saved for other programs, printed. One print at a time. Any thread may use it.

A print is prepared first: the printer is asked, the model checked and sliced. Then a person is asked, by a question that names file and printer;
only an answer that names both starts it.
"""

import math
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock, Thread
from typing import Final

from common.errors import SettingsError, TandemError, UnavailableError
from common.words import counted
from phone_host.output.data_folder import data_folder
from phone_host.output.meshes.formats import FORMATS
from phone_host.output.meshes.printable import Printer
from phone_host.printers.bed import parse_bed
from phone_host.printers.door import Ended, Job, Phase, PrinterDoor, Progress
from phone_host.printers.doors import configured_door
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted, job_of
from phone_host.printers.printer_uri import FileUri, PrinterUri, read_uri
from phone_host.printers.printing import Place, RunningPrint
from phone_host.printers.slicing import SlicingWanted
from phone_host.run.model_job import check_model, export_model
from phone_host.serve.choices import Choices
from phone_host.settings import printer_keys
from phone_host.web.source import PrintStage, PrintState

_GIVEN_UP_S: Final = 2.0
"""A slicer is ended at once; whoever waits for a printer's answer is not waited for."""

_END_S: Final = 20.0
"""A printer on a line has its heaters off after a second; a server is given time to answer."""


class _GivenUpError(Exception):
    """Raised inside what prepares a print that nobody wants any more. Nobody's fault."""


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


class Workshop:
    """Makes things of a scan.

    Args:
        tell: is called when something has changed.
    """

    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell = tell
        self._lock = Lock()
        self._kept = ExitStack()
        self._state: PrintState | None = None
        self._wanted: PrintWanted | None = None
        self._job: Job | None = None
        self._running: RunningPrint | None = None
        self._is_unwanted = self._is_closed = False
        self._preparing: Thread | None = None

    @property
    def state(self) -> PrintState | None:
        """How the print goes, or went; None: there was none."""
        return self._state

    def check(self, folder: str, wanted: PrintWanted) -> str:
        """Tell whether the model can be printed.

        Args:
            folder: of the scan.
            wanted: the bed.

        Raises:
            SettingsError: there is no scan.
            DataError: its model cannot be read.
        """
        found = check_model(_some(folder), Printer(bed_mm=wanted.how.slicing.model_bed.size_mm))
        blocking = [problem for problem in found if problem.blocks]
        if blocking:
            return f"it cannot be printed: {'; '.join(problem.sentence for problem in blocking)}: {blocking[0].remedy}"
        notes = "; ".join(f"{problem.sentence}: {problem.remedy}" for problem in found)
        return f"it can be printed, but: {notes}" if notes else "it can be printed"

    def save(self, folder: str, kind: str) -> str:
        """Save the model for other programs, beside its files; return what to say.

        Args:
            folder: of the scan.
            kind: format.

        Raises:
            SettingsError: there is no scan, or no such format.
            UnavailableError: the file cannot be written.
        """
        place = _some(folder)
        try:
            [path] = export_model(place, (kind,), place)
        except OSError as error:
            raise UnavailableError(
                f"the {kind} file cannot be written to {place} ({error.strerror})", "make room on the disk"
            ) from None
        return f"saved as {path.name}"

    def saved(self, folder: str) -> tuple[str, ...]:
        """Return the names of the files that `save` has written beside a scan."""
        place = Path(folder) if folder else None
        paths = [] if place is None else [place / f"{place.name}.{kind}" for kind in FORMATS]
        return tuple(path.name for path in paths if path.is_file())

    def prepare(self, folder: str, wanted: PrintWanted) -> str:
        """Begin to check and slice the model; the state tells when it is ready.

        Args:
            folder: of the scan.
            wanted: printer and bed.

        Raises:
            SettingsError: there is no scan, no printer, or a print goes on.
        """
        place = _some(folder)
        if wanted.uri is None or wanted.door is None:
            raise SettingsError("no printer is given", "give its address, such as octoprint://octopi.local")
        with self._lock:
            self._require_free()
            if self._is_closed:
                raise SettingsError("the program ends", "start it again")
            self._wanted, self._is_unwanted = wanted, False
            self._show(PrintStage.PREPARING, "the printer is asked")
            self._preparing = Thread(target=self._prepare, args=(place, wanted), name="prepare a print", daemon=True)
            self._preparing.start()
        return "it is prepared"

    def start(self, confirmed: str) -> str:
        """Start the print that was prepared.

        Args:
            confirmed: what the person has agreed to: the state's `asks`.

        Raises:
            SettingsError: nothing is prepared, or something else was agreed to.
        """
        with self._lock:
            state, wanted, job = self._state, self._wanted, self._job
            if state is None or state.stage is not PrintStage.ASKS or wanted is None or job is None:
                raise SettingsError("nothing is ready to be printed", "prepare it first")
            if confirmed != state.asks:
                raise SettingsError(
                    f"that is not what would be printed: {state.asks}", "look at file and printer again"
                )
            assert wanted.door is not None
            place = Place(wanted.door, wanted.text, str(job.gcode), wanted.journal)
            self._running = RunningPrint(place, job, tell=self._heard, over=self._over)
            self._show(PrintStage.PRINTING, f"{job.name}: waiting for the printer")
            self._running.start()
        return "it begins"

    def pause(self) -> str:
        """Pause the print, or go on.

        Raises:
            SettingsError: nothing is printed.
        """
        with self._lock:
            running = self._require_running()
            if running.progress.phase is Phase.PAUSED:
                running.go_on()
                return "it goes on"
            running.pause()
        return "it pauses; the heaters stay on"

    def cancel(self) -> str:
        """End what is prepared or printed; heaters are switched off.

        Raises:
            SettingsError: nothing is.
        """
        with self._lock:
            if self._state is None or self._state.stage is PrintStage.OVER:
                raise SettingsError("nothing is printed", "prepare something first")
            if self._running is not None:
                self._running.cancel()
                return "it is cancelled; the heaters are switched off"
            self._is_unwanted = True
            if self._state.stage is PrintStage.ASKS:
                self._put_away("not printed")
            else:
                self._show(PrintStage.PREPARING, "print cancelled")
        return "not printed"

    def close(self) -> None:
        """End what goes on; the process ends."""
        with self._lock:
            running, preparing = self._running, self._preparing
            self._is_unwanted = self._is_closed = True
        if running is not None:
            running.cancel()
            running.join(_END_S)
        if preparing is not None:
            preparing.join(_GIVEN_UP_S)
        with self._lock:
            if self._state is not None and self._state.stage is PrintStage.ASKS:
                self._put_away("not printed")

    def _prepare(self, place: Path, wanted: PrintWanted) -> None:
        kept = ExitStack()
        with self._lock:
            self._kept = kept
        try:
            assert wanted.door is not None
            assert wanted.uri is not None
            wanted.door.require_ready()
            self._say("reading")
            job = kept.enter_context(job_of(place, wanted.how, wanted.uri, self._say))
        except _GivenUpError:
            self._not_prepared("not printed")
            return
        except TandemError as error:
            self._not_prepared(f"{error.problem}: {error.remedy}")
            return
        except Exception as error:  # noqa: BLE001 - a thread's root: the page is told
            self._not_prepared(f"it cannot be prepared ({type(error).__name__}: {error})")
            return
        with self._lock:
            if self._is_unwanted:
                self._put_away("not printed")
                return
            self._job = job
            asks = f"{job.name} on {wanted.text}"
            minutes = "" if math.isnan(job.facts.seconds) else f", {max(1, round(job.facts.seconds / 60))} min"
            facts = f"({counted(job.facts.lines, 'line')}{minutes})"
            if isinstance(wanted.uri, FileUri):
                words = f"write {job.name} to {wanted.uri.path} {facts}?"
            else:
                words = f"print {asks} {facts}? Make sure that the bed is empty"
            self._show(PrintStage.ASKS, words, asks=asks)

    def _not_prepared(self, words: str) -> None:
        with self._lock:
            if self._is_unwanted:
                self._put_away("not printed")
            else:
                self._put_away(words, level="bad")

    def _say(self, words: str) -> None:
        """Tell what is done next; called several times a second in the thread that prepares.

        Raises:
            _GivenUpError: nobody wants it any more.
        """
        with self._lock:
            if self._is_unwanted:
                raise _GivenUpError
            if self._state is None or self._state.words != words:
                self._show(PrintStage.PREPARING, words)

    def _heard(self, progress: Progress) -> None:
        """Take how far the print is; called in its thread."""
        assert self._job is not None
        stage = PrintStage.PAUSED if progress.phase is Phase.PAUSED else PrintStage.PRINTING
        heat = progress.heat
        left = "" if math.isnan(progress.seconds_left) else f", {progress.seconds_left / 60:.0f} min left"
        message = f" ({progress.message})" if progress.message else ""
        words = f"{self._job.name}: {progress.phase.value}{message}, nozzle {heat.nozzle[0]:.0f}, bed {heat.bed[0]:.0f} \u00b0C{left}"
        self._show(stage, words, share=progress.share)

    def _over(self, outcome: Ended | TandemError) -> None:
        """Take how it has ended; called in its thread."""
        assert self._job is not None
        name = self._job.name
        if isinstance(outcome, TandemError) or outcome.phase is Phase.FAILED:
            words, level = f"{outcome.problem}: {outcome.remedy}", "bad"
        elif outcome.phase is Phase.CANCELLED:
            words, level = f"{name}: cancelled; heaters are off", "warning"
        else:
            uri = None if self._wanted is None else self._wanted.uri
            done = f"{name}: written to {uri.path}" if isinstance(uri, FileUri) else f"{name}: printed"
            words, level = "; ".join((done, *outcome.notes)), "good"
        with self._lock:
            self._put_away(words, level=level)

    def _put_away(self, words: str, *, level: str = "unknown") -> None:
        kept, self._kept, self._job, self._running = self._kept, ExitStack(), None, None
        with suppress(OSError):  # a folder that cannot be removed must not keep the next print away
            kept.close()
        self._show(PrintStage.OVER, words, level=level)

    def _require_free(self) -> None:
        if self._state is not None and self._state.stage is PrintStage.PREPARING and self._is_unwanted:
            raise SettingsError("the previous print is still being cancelled", "try again in a moment")
        if self._state is not None and self._state.stage is not PrintStage.OVER:
            raise SettingsError("another print is active", "cancel it first")

    def _require_running(self) -> RunningPrint:
        if self._running is None:
            raise SettingsError("nothing is printed", "prepare and start it first")
        return self._running

    def _show(
        self, stage: PrintStage, words: str, *, level: str = "unknown", share: float = 0.0, asks: str = ""
    ) -> None:
        self._state = PrintState(stage=stage, words=words, level=level, share=share, asks=asks)
        self._tell()


def _some(folder: str) -> Path:
    if not folder:
        raise SettingsError("there is no scan yet", "scan something, and stop, first")
    return Path(folder)
