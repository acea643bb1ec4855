"""A program behind the page that plays rendered pairs with known truth, and does at once what it is told."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

from common import now
from common.diagnostic import Diagnostic
from common.ledger import BoardMarks, HostMarks, StageTimes
from phone_host.accounts.link_account import LinkAccount, LinkTally
from phone_host.calibration.guide.coverage import Coverage
from phone_host.calibration.guide.gates import Gate
from phone_host.calibration.guide.snapshot import Ended, GuideSnapshot
from phone_host.calibration.guide.wants import Want
from phone_host.diagnostics.image_judge import ImageTrust
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.model import Processed, Result
from phone_host.scan.patches import Patches
from phone_host.scene.scene import Truth, demo_scene, rectified_cameras, truth
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.sync.clock import ClockEstimate
from phone_host.web.source import (
    Activity,
    Answer,
    Choice,
    Command,
    Do,
    Feed,
    Measured,
    Newest,
    PageState,
    PrintState,
    ScanState,
    Step,
    StepName,
    Surface,
)
from tests.support.plain_scenes import matched_view
from tests.support.run_snapshots import run as snapshot
from tests.support.samples import LEDGER

MS = 1_000_000
PERIOD_S = 4.0

BOARDS = (
    Choice(uri="tcp://192.168.7.2:5555", name="beagle-4f2a", note="needs its code"),
    Choice(uri="tcp://192.168.1.40:5555", name="beagle-09c1"),
)
CAMERAS = (
    Choice(uri="v4l2:/dev/video0?size=640x480&fps=30", name="Integrated Camera"),
    Choice(uri="http://127.0.0.1:8080/video", name="IP Webcam", note="no stamps"),
)


RECORDING = RecordingAccount(
    file="/home/me/.local/share/tandemscan/recordings/2026-11-23-221918.mcap",
    frames=720,
    dropped=0,
    lost=0,
    size_bytes=36_900_000,
    seconds=12.0,
    left_bytes=41_200_000_000,
    is_over=False,
)


@cache
def rendered(count: int) -> tuple[Processed, ...]:
    """Match pairs of the demo's scene, evenly over its period; at least one."""
    cameras = rectified_cameras(matched_view())
    left, right = (Renderer(demo_scene(), model, pose) for model, pose in cameras)
    core = StereoCore(MatchSettings(disparities=112), None, matched_view().geometry, DepthWanted(far_m=6.0))
    times = [number * PERIOD_S / count for number in range(count)]
    return tuple(core.compute(left.frame(t), right.frame(t), now.monotonic_ns) for t in times)


@cache
def true_depth(count: int, number: int) -> Truth:
    """What a perfect matcher would find in a pair of `rendered`."""
    return truth(demo_scene().at(number * PERIOD_S / count), matched_view())


@dataclass
class Played:
    """Implements `Source`. Tests set its fields; `emit` makes the next result.

    Attributes:
        pairs: that are shown, in turn.
        commands: what the page asked for.
        answers: to a command of this kind; default: done.
    """

    pairs: tuple[Processed, ...]
    activity: Activity = Activity.IDLE
    feed: Feed | None = None
    settings: dict[str, str] = field(default_factory=dict)
    done: set[StepName] = field(default_factory=set)
    boards: tuple[Choice, ...] | None = BOARDS
    cameras: tuple[Choice, ...] | None = CAMERAS
    stranger: str = BOARDS[0].uri
    steps: tuple[StepName, ...] = tuple(StepName)
    guide: GuideSnapshot | None = None
    trouble: Diagnostic | None = None
    concerns: tuple[Diagnostic, ...] = ()
    motion_px_s: float = math.nan
    recording: RecordingAccount | None = None
    folder: str = ""
    scan: ScanState | None = None
    printing: PrintState | None = None
    patches: Patches | None = None
    axes: str = "camera"
    begun: int = 0
    commands: list[Command] = field(default_factory=list)
    answers: dict[Do, Answer] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Start with no result."""
        self._lock = threading.Lock()
        self._told: list[Callable[[], None]] = []
        self._results: list[Newest] = []
        self._changed = 0
        self._started_ns = now.monotonic_ns()

    def emit(self, delays_ms: Sequence[float] = (4, 2, 9, 3, 6, 48)) -> int:
        """Make the next result, done now; return its number."""
        with self._lock:
            number = len(self._results)
            processed = self.pairs[number % len(self.pairs)]
            result = Result(number, None, processed, _ledger(number, delays_ms))  # type: ignore[arg-type]
            self._results.append(Newest(number, result, self.begun))
        self.tell()
        return number

    def change(self, **fields: Any) -> None:
        """Change fields, and tell."""
        for name, value in fields.items():
            setattr(self, name, value)
        self._changed += 1
        self.tell()

    def tell(self) -> None:
        """Tell all that there is something new."""
        for told in tuple(self._told):
            told()

    def state(self) -> PageState:
        """Implement Source."""
        run = None
        if self._of_this_run() or self.activity is Activity.RUNNING:
            run = self._run()
        words = {
            StepName.BOARD: "choose the board that carries the left camera",
            StepName.CAMERA: "choose the camera of this machine",
            StepName.CHECK: "have the machine, the board and both cameras checked",
            StepName.CALIBRATION: "show the printed board to both cameras, or choose a rig.yaml",
            StepName.RUN: "start the run",
            StepName.SCAN: "start, and move the cameras around the thing",
        }
        steps = tuple(Step(name=name, done=name in self.done, words=words[name]) for name in self.steps)
        options = " ".join(f"--{name} {value}" for name, value in sorted(self.settings.items()))
        return PageState(
            activity=self.activity,
            steps=steps,
            command=f"phone-host run {options}" if {"link", "camera"} <= self.settings.keys() else "",
            scan_command=f"phone-host scan {options}" if {"link", "camera"} <= self.settings.keys() else "",
            settings=dict(self.settings),
            boards=self.boards,
            cameras=self.cameras,
            stranger=self.stranger if self.settings.get("link") == self.stranger else "",
            matchers=("tandem", "tandem-fast", "sgbm"),
            run=run,
            guide=None if self.guide is None else self.guide.as_json(),
            scan=self.scan,
            printing=self.printing,
            trouble=self.trouble,
            changed=self._changed,
            begun=self.begun,
        )

    def newest(self) -> Newest | None:
        """Implement Source."""
        with self._lock:
            return self._results[-1] if self._results else None

    def subscribe(self, told: Callable[[], None]) -> Callable[[], None]:
        """Implement Source."""
        self._told.append(told)
        return lambda: self._told.remove(told)

    def command(self, command: Command) -> Answer:
        """Implement Source: settings, start and stop are done; all else is answered."""
        self.commands.append(command)
        match command.do:
            case Do.SET:
                kept = {name: value for name, value in (self.settings | dict(command.values)).items() if value}
                if Do.SET not in self.answers:
                    self.change(settings=kept)
            case Do.RUN:
                self.change(activity=Activity.RUNNING, begun=self.begun + 1)
            case Do.SCAN:
                self.change(activity=Activity.SCANNING, begun=self.begun + 1)
            case Do.STOP:
                self.change(activity=Activity.IDLE)
            case Do.ENROL:
                self.change(stranger="")
            case Do.RECORD:
                self.change(recording=RECORDING)
            case Do.END_RECORDING:
                self.change(recording=replace(RECORDING, is_over=True))
            case Do.CALIBRATE:
                self.change(activity=Activity.CALIBRATING)
            case _:
                pass
        return self.answers.get(command.do, Answer(words=f"{command.do.value}: done"))

    def measure(self, points_px: Sequence[tuple[float, float]], number: int | None) -> Measured:
        """Implement Source, from the result's own cloud; 1 mm uncertain each."""
        result = self._results[-1 if number is None else number].result
        cloud = result.processed.cloud
        assert cloud is not None
        places = [cloud[round(y), round(x)].astype(float) for x, y in points_px]
        known = [bool(np.isfinite(place).all()) for place in places]
        length = float(np.linalg.norm(places[0] - places[1])) if len(places) == 2 and all(known) else None
        return Measured(
            places_m=tuple(tuple(p.tolist()) if ok else None for p, ok in zip(places, known, strict=True)),
            distances_m=tuple(float(np.linalg.norm(p)) if ok else None for p, ok in zip(places, known, strict=True)),
            place_sigmas_m=tuple(0.001 if ok else None for ok in known),
            length_m=length,
            length_sigma_m=None if length is None else 0.0014,
            words="" if all(known) else "there is no depth at this point",
        )

    def surface(self, since: int, most_points: int) -> Surface | None:
        """Implement Source."""
        return None if self.patches is None else Surface(self.begun, self.patches.since(since, most_points), self.axes)

    def scanned(self) -> str:
        """Implement Source."""
        return "" if self.scan is None else self.scan.folder

    def saved(self) -> str:
        """Implement Source."""
        return self.folder

    def _of_this_run(self) -> list[Result]:
        with self._lock:
            return [each.result for each in self._results if each.begun == self.begun]

    def _run(self) -> Any:
        own = self._of_this_run()
        count, newest = len(own), own[-1] if own else None
        has_depth = newest is not None and newest.processed.disparity is not None
        figures = ImageFigures(density=0.93, consistency=0.97, scattered_share=0.01, vertical_px=0.12)
        images = ImageTrust(
            judged=count,
            wants_depth=has_depth or not count,
            has_depth=has_depth,
            start=figures if has_depth else ImageFigures(),
            now=figures if has_depth else ImageFigures(),
            concerns=self.concerns,
            newest=self.concerns,
            geometry=matched_view().geometry,
            disparity_error_px=0.2,
        )
        account = LinkAccount([], links=(LinkTally("usb", frames=count, is_up=True),))
        estimate = ClockEstimate(
            reference_ns=0,
            offset_ns=1_500_000,
            skew=1e-6,
            skew_uncertainty=1e-7,
            uncertainty_ns=85_000,
            round_trip_ns=400_000,
            low_ns=1_400_000,
            high_ns=1_600_000,
            skew_low=-1e-4,
            skew_high=1e-4,
        )
        base = snapshot(min(count, 200))
        limits = None if newest is None else newest.processed.limits
        return replace(
            base,
            ended="running" if self.activity is Activity.RUNNING else "stopped",
            processed=count,
            link=account,
            carrier="usb",
            estimate=estimate,
            images=images,
            motion_px_s=self.motion_px_s,
            width_px=640,
            stamps_exact=True,
            depth=replace(base.depth, limits=limits),
            recording=self.recording,
        )


def _ledger(number: int, delays_ms: Sequence[float]) -> Any:
    """Return the marks of a pair that is done now."""
    capture, outbox, propagation, pairing, queuing, processing = (round(value * MS) for value in delays_ms)
    done = now.monotonic_ns()
    dequeued = done - processing
    queued = dequeued - queuing
    received = queued - pairing
    sent = received - propagation
    grabbed = sent - outbox
    board = BoardMarks(exposed_ns=grabbed - capture, grabbed_ns=grabbed, sent_ns=sent)
    return replace(
        LEDGER,
        sequence=number,
        host_sequence=number,
        board=board,
        received_ns=received,
        paired_ns=queued,
        queued_ns=queued,
        dequeued_ns=dequeued,
        done_ns=done,
        previous_done_ns=done,
        stages=StageTimes(decode=4 * MS, rectify=6 * MS, match=processing - 14 * MS, reproject=4 * MS),
        time_skew_ns=round(1.5 * MS * np.sin(number / 9.0)),
        host=HostMarks(exposed_ns=board.exposed_ns, grabbed_ns=board.grabbed_ns),
    )


def guide_snapshot(views: int = 7) -> GuideSnapshot:
    """Return a live calibration that is on its way."""
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:6, :8]
    near = np.exp(-((rows - 2.2) ** 2 + (columns - 3.5) ** 2) / 9) * 60 + rng.integers(0, 9, (6, 8)) - 8
    cells = tuple(tuple(int(max(0, v)) for v in row) for row in near)
    coverage = Coverage((640, 480), cells, (2, 4, 1), (3, 1, 1, 2, 0))
    outline = ((0.52, 0.2), (0.86, 0.24), (0.83, 0.62), (0.5, 0.57))
    shifted = tuple((x - 0.12, y) for x, y in outline)
    return GuideSnapshot(
        ended=Ended.RUNNING,
        words="tilt the board: bottom edge away",
        gate=Gate.NOT_FOUND,
        board="9x6",
        views=views,
        most_views=30,
        seconds=41.0,
        coverage=(coverage, replace(coverage, cells=tuple(reversed(cells)))),
        outlines=(outline, shifted),
        asked=Want.BOTTOM_AWAY,
        wanted=(Want.BOTTOM_AWAY, Want.TOP_RIGHT, Want.BOTTOM_LEFT, Want.FAR),
        depth_error_m=0.0021,
        next_error_m=0.0016,
        verdict="usable",
        remedy="more views at the edges",
        refused=((Gate.NOT_FOUND, 12),),
    )


@contextmanager
def playing(source: Played, hz: float) -> Iterator[None]:
    """Emit results at a rate while the block runs."""
    ended = threading.Event()

    def play() -> None:
        rng = np.random.default_rng(1)
        while not ended.wait(1 / hz):
            wave = rng.gamma(4.0, 0.25, 6)
            source.emit([base * part for base, part in zip((4, 2, 9, 3, 6, 48), wave, strict=True)])

    thread = threading.Thread(target=play)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
