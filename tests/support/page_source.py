"""The program behind the page, for tests of the server: results whose depth follows from geometry, and a record of commands."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import BoardFrame, FramePair, Processed, Result
from phone_host.scan.patches import Patches
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
    Step,
    StepName,
    Surface,
)
from tests.support.run_snapshots import run
from tests.support.samples import FRAME, LEDGER, shot
from tests.support.stereo_pages import processed

REFUSED: Final = Diagnostic("no board is chosen", "choose one first", Severity.FAIL)


class PageSource:
    """Shows a result whenever a test says so.

    Args:
        shown: the images and depth of all results.
        saved: folder with saved pairs; empty: none.
    """

    def __init__(self, shown: Processed | None = None, saved: str = "") -> None:
        self.processed = processed() if shown is None else shown
        self.feed: Feed | None = None
        self.asked: list[Command] = []
        self.commands: list[Command] = []
        self.asked_states = 0
        self.run: RunSnapshot | None = None
        self.blocked = threading.Event()
        self.blocked.set()
        self._saved = saved
        self.patches: Patches | None = None
        self.scan_folder = ""
        self._number = -1
        self._lock = threading.Lock()
        self._told: list[Callable[[], None]] = []

    def show(self, pairs: int = 1) -> int:
        """Show further results. Return the number of the last."""
        for _ in range(pairs):
            with self._lock:
                self._number += 1
                told = list(self._told)
            for each in told:
                each()
        return self._number

    def start_run(self, pairs: int) -> None:
        """Have a run of some pairs in the state."""
        self.run = replace(run(pairs), ended="running")

    def state(self) -> PageState:
        """Return a state with something in every field."""
        self.asked_states += 1
        return PageState(
            activity=Activity.IDLE if self.run is None else Activity.RUNNING,
            steps=(Step(name=StepName.BOARD, done=False, words="Choose a board."),),
            command="phone-host run",
            settings={"link": "tcp://board:5555"},
            boards=(Choice(uri="tcp://board:5555", name="board"),),
            stranger="tcp://board:5555",
            matchers=("tandem", "sgbm"),
            run=self.run,
            trouble=REFUSED,
        )

    def newest(self) -> Newest | None:
        """Return the newest result."""
        number = self._number
        if number < 0:
            return None
        ledger = replace(LEDGER, sequence=number, done_ns=(number + 1) * 50_000_000, dequeued_ns=number * 50_000_000)
        board = BoardFrame(message=FRAME, link="tcp", marks=FRAME.marks, received_ns=0, offset_ns=0, uncertainty_ns=0)
        host = shot(0, pixel_format=FRAME.pixel_format)
        pair = FramePair(board=board, host=host, time_skew_ns=0, paired_ns=0, queued_ns=0)
        return Newest(number, Result(number, pair, self.processed, ledger))

    def subscribe(self, told: Callable[[], None]) -> Callable[[], None]:
        """Tell of results."""
        self._told.append(told)
        return lambda: self._told.remove(told)

    @property
    def listeners(self) -> int:
        """How many are told."""
        return len(self._told)

    def command(self, command: Command) -> Answer:
        """Record a command; a test may block it. A run is refused."""
        self.asked.append(command)
        self.blocked.wait(30)
        self.commands.append(command)
        return Answer(trouble=REFUSED) if command.do is Do.RUN else Answer(words=f"Did {command.do.value}.")

    def measure(self, points_px: Sequence[tuple[float, float]], number: int | None) -> Measured:
        """Say that every point lies 2 m ahead."""
        del number
        count = len(points_px)
        return Measured(
            places_m=((0.0, 0.0, 2.0),) * count,
            place_sigmas_m=(0.05,) * count,
            distances_m=(2.0,) * count,
            length_m=None if count < 2 else 0.0,
        )

    def surface(self, since: int, most_points: int) -> Surface | None:
        """See Source."""
        patches = () if self.patches is None else self.patches.since(since, most_points)
        return None if self.patches is None else Surface(1, patches)

    def scanned(self) -> str:
        """See Source."""
        return self.scan_folder

    def saved(self) -> str:
        """Return the folder."""
        return self._saved


def page_folder(folder: Path) -> Path:
    """Write a small page: an inline script, a module with its compressed forms, and a file in a folder."""
    (folder / "lib").mkdir(parents=True)
    (folder / "index.html").write_text(
        '<!doctype html><title>t</title><script type="importmap">{"imports":{}}</script>'
    )
    (folder / "main.js").write_text("export const answer = 42;\n" * 50)
    (folder / "main.js.br").write_bytes(b"brotli's bytes")
    (folder / "main.js.gz").write_bytes(b"gzip's bytes")
    (folder / "lib" / "a.css").write_text("body{}")
    return folder
