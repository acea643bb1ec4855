"""The border between the page's server and the program behind it: what the page is told, and what it may ask. Pure.

The server holds a `Source` and nothing else of the program. Everything that a source returns is a copy.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import Result


class Activity(Enum):
    """What the program does now."""

    IDLE = "idle"
    ENROLLING = "enrolling"
    CHECKING = "checking"
    CALIBRATING = "calibrating"
    RUNNING = "running"
    SCANNING = "scanning"
    ENDING = "ending"


class StepName(Enum):
    """The steps from nothing to a run and a scan, in their order."""

    BOARD = "board"
    CAMERA = "camera"
    CHECK = "check"
    CALIBRATION = "calibration"
    RUN = "run"
    SCAN = "scan"


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step on the way to a run.

    Attributes:
        name: which one.
        done: whether it needs no more care.
        words: what it has come to, or what to do now; one sentence.
    """

    name: StepName
    done: bool
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Something that may be chosen: a board or a camera.

    Attributes:
        uri: as the command line takes it.
        name: for people.
        note: what is to be known of it, such as "needs its code"; may be empty.
    """

    uri: str
    name: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanState:
    """How a scan goes, or went.

    Attributes:
        words: what to do now, or what came of it; one sentence.
        level: good, warning (it goes on, but badly), bad (what is shown now is not taken) or unknown.
        pairs: that were taken, whether or not they are in the model.
        fused: of these in the model.
        folder: where its files lie; empty: they are not written yet.
        files: their names.
        options: of `scan` by name, with which it was started: voxel, box, mat, turntable, object, unseen; every viewer shows these.
    """

    words: str
    level: str = "unknown"
    pairs: int = 0
    fused: int = 0
    folder: str = ""
    files: tuple[str, ...] = ()
    options: Mapping[str, str] = field(default_factory=dict)


class PrintStage(Enum):
    """How far a print of the page is."""

    PREPARING = "preparing"
    ASKS = "asks"
    PRINTING = "printing"
    PAUSED = "paused"
    OVER = "over"


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintState:
    """How a print of the page goes, or went.

    Attributes:
        stage: how far it is.
        words: what goes on, what is asked, or what came of it; one sentence.
        level: good, warning, bad or unknown.
        share: of the print that is done, 0..1.
        asks: file and printer that a person has to agree to, before anything is heated or moved; empty: nothing is asked.
    """

    stage: PrintStage
    words: str
    level: str = "unknown"
    share: float = 0.0
    asks: str = ""


class SurfaceMesh(Protocol):
    """Triangles with colours, as `phone_host.scan.mesh.Mesh` has them."""

    @property
    def points_m(self) -> NDArray[np.float32]:
        """Places, (V, 3), m: x right, y down, z forward of the first left camera."""

    @property
    def colours(self) -> NDArray[np.uint8]:
        """Red green blue of each point, (V, 3)."""

    @property
    def triangles(self) -> NDArray[np.int32]:
        """Numbers of points, (T, 3), anticlockwise as seen from where the camera was."""


class SurfacePatch(Protocol):
    """A part of a growing surface; a newer one of the same place takes its place."""

    @property
    def number(self) -> int:
        """Grows with each patch that is made."""

    @property
    def place(self) -> tuple[int, int, int]:
        """Of its cube, in cubes."""

    @property
    def side_m(self) -> float:
        """Of the cube; its points lie at most a tenth of it beyond."""

    @property
    def mesh(self) -> SurfaceMesh:
        """The surface in it; fewer than 65 536 points."""

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(V,) whether some view measured each of its points."""


@dataclass(frozen=True, slots=True)
class Surface:
    """What of a scan's surface is new.

    Attributes:
        begun: `PageState.begun` of the scan.
        patches: oldest first; those that are left out come next time.
        axes: of their places: camera (x right, y down, z forward of the first left camera) or mat (z up).
    """

    begun: int
    patches: Sequence[SurfacePatch]
    axes: str = "camera"


@dataclass(frozen=True, slots=True, kw_only=True)
class PageState:
    """Everything that the page shows beside images.

    Attributes:
        activity: what the program does now.
        steps: the way to a run; empty: the run was started elsewhere, and nothing can be set here.
        command: the command line that does what the page's choices do; empty: not enough is chosen.
        scan_command: the command line of a scan with these choices, without the options of the scan itself; empty: there is none.
        settings: the choices, by the option's name without dashes, as the command line takes them.
        boards: boards that were found; None: nobody has looked yet.
        cameras: cameras of this machine; None likewise.
        stranger: the chosen board that does not know this machine yet, by its address; empty: there is none.
        matchers: names that `--matcher` takes.
        run: the run, live or the last one; None: there was none.
        guide: the live calibration, as its guide.json has it; None: there was none.
        scan: the scan, live or the last one; None: there was none.
        printing: the print, live or the last one; None: there was none.
        checks: what the last check has looked at, in order.
        trouble: what went wrong last; None: nothing.
        changed: grows with each change of anything but `run` and `guide`.
        begun: grows with each activity that begins: results of an earlier one do not belong to `run`.
    """

    activity: Activity
    steps: tuple[Step, ...] = ()
    command: str = ""
    scan_command: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)
    boards: tuple[Choice, ...] | None = None
    cameras: tuple[Choice, ...] | None = None
    stranger: str = ""
    matchers: tuple[str, ...] = ()
    run: RunSnapshot | None = None
    guide: Mapping[str, object] | None = None
    scan: ScanState | None = None
    printing: PrintState | None = None
    checks: tuple[Diagnostic, ...] = ()
    trouble: Diagnostic | None = None
    changed: int = 0
    begun: int = 0


class Do(Enum):
    """What the page may ask for. Each needs the token."""

    FIND = "find"
    ENROL = "enrol"
    SET = "set"
    CHECK = "check"
    CAPTURE = "capture"
    CALIBRATE = "calibrate"
    RUN = "run"
    SCAN = "scan"
    CROP = "crop"
    STOP = "stop"
    SNAPSHOT = "snapshot"
    RECORD = "record"
    END_RECORDING = "end_recording"
    CHECK_MODEL = "check_model"
    SAVE_MODEL = "save_model"
    PREPARE_PRINT = "prepare_print"
    PRINT = "print"
    PAUSE_PRINT = "pause_print"
    CANCEL_PRINT = "cancel_print"


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command of the page.

    Attributes:
        do: what.
        values: for SET, CALIBRATE and SCAN, options of the command `run`, `calibrate` or `scan` by name, in SET an empty value takes
            one back; for ENROL `link` and `code`; for CROP, while a scan goes on, `box`; for CHECK_MODEL `bed`; for SAVE_MODEL `format`; for
            PREPARE_PRINT `printer` and `bed`; for PRINT `confirm`, the state's `printing.asks`. Empty for the others.
    """

    do: Do
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What became of a command.

    Attributes:
        words: what happened, one sentence.
        trouble: why it did not; None: it did.
    """

    words: str = ""
    trouble: Diagnostic | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Places and their distances, from the newest pair or the one that was named.

    Attributes:
        places_m: X, Y, Z of each point, m; None: no depth there.
        place_sigmas_m: standard uncertainty of each point's distance from the left camera, m; None likewise.
        distances_m: of each point from the left camera, m.
        length_m: between the first two points, m; None: not two points with depth.
        length_sigma_m: its standard uncertainty, m.
        words: why something could not be measured; empty: everything was.
    """

    places_m: tuple[tuple[float, float, float] | None, ...]
    distances_m: tuple[float | None, ...]
    place_sigmas_m: tuple[float | None, ...]
    length_m: float | None = None
    length_sigma_m: float | None = None
    words: str = ""


@dataclass(frozen=True, slots=True)
class Newest:
    """A result with its number. Numbers grow by one with each result, over all runs of this program.

    Attributes:
        number: of the result.
        result: the result.
        begun: `PageState.begun` of its run.
    """

    number: int
    result: Result
    begun: int = 0


class Line(Protocol):
    """A WebSocket over which a browser gives its camera, as the server hands it on."""

    @property
    def is_near(self) -> bool:
        """Whether it comes from this machine, as far as its address tells."""

    def say(self, text: str) -> None:
        """Send a text, soon. Safe from any thread."""

    def close(self) -> None:
        """Close it after what was said. Safe from any thread."""


class Hearer(Protocol):
    """Takes what comes over a line. Called in the server's thread; returns at once."""

    def heard(self, said: str | bytes, now_ns: int) -> str:
        """Take a message.

        Args:
            said: text or bytes.
            now_ns: when it came, CLOCK_MONOTONIC, ns.

        Returns:
            What to answer at once; empty: nothing.
        """

    def left(self) -> None:
        """The line has ended."""


class Feed(Protocol):
    """What a browser gives its camera to. Called in the server's thread; returns at once."""

    def camera(self, line: Line, hello: str) -> Hearer | None:
        """Take a browser's first line, for frames.

        Returns:
            What hears the rest; None: it is refused, and was told so.
        """

    def clock(self, line: Line, hello: str) -> Hearer | None:
        """Take a browser's second line, for clock echoes; as above, but that its hello names the session instead of the token."""


class Source(Protocol):
    """The program behind the page. Its methods may be called from any thread."""

    @property
    def feed(self) -> Feed | None:
        """What browsers give their cameras to; None: nothing here takes them."""

    def state(self) -> PageState:
        """Return the state now. Takes a few milliseconds at most."""

    def newest(self) -> Newest | None:
        """Return the newest result; None: there is none."""

    def subscribe(self, told: Callable[[], None]) -> Callable[[], None]:
        """Have a function called whenever there is a newer result or the activity changes.

        It is called from threads of the run and must return at once. Return a function that ends this.
        """

    def command(self, command: Command) -> Answer:
        """Do what the page asks. May take seconds; never raises for what the page got wrong."""

    def measure(self, points_px: Sequence[tuple[float, float]], number: int | None) -> Measured:
        """Measure points of the rectified left image.

        Args:
            points_px: x, y of one or two points, px of the full image.
            number: of the result; None: the newest. One that is gone is answered in `words`.
        """

    def surface(self, since: int, most_points: int) -> Surface | None:
        """Return what of the scan's surface is newer than a patch; None: there is no scan.

        Args:
            since: number of the newest patch that is known; 0: none is.
            most_points: of all patches together; one comes in any case.
        """

    def scanned(self) -> str:
        """Return the path of the folder with the files of the last scan; empty: there is none."""

    def saved(self) -> str:
        """Return the path of the folder with the saved pairs (pair-NNNNNN); empty: nothing is saved."""
