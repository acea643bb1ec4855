"""The page beside an ordinary `run`: it shows the run, may stop it, record it and take snapshots. All else needs a run of its own."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import TandemError
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.output.axes import Axes
from phone_host.run.host import Host
from phone_host.serve.choices import Choices
from phone_host.serve.memory import Memory
from phone_host.serve.point_answer import ShelfSource
from phone_host.serve.saved import Recordings, keep_newest
from phone_host.serve.shelf import PageSink
from phone_host.stereo.core import StereoCore
from phone_host.web.source import Activity, Answer, Command, Do, PageState, Surface

_NEEDS_SERVE: Final = Diagnostic(
    "this page only shows a run that was started on the command line",
    "stop it and run `phone-host serve`, where the page sets everything",
    Severity.FAIL,
)


class BesideRun(ShelfSource):
    """The source behind the page of `run --serve`.

    Args:
        choices: the run's options, as they may be shown.
        command: makes the command line of such options.
        snapshots: folder for snapshots.
        recordings: folder for recordings.
        axes: of the points in them.
    """

    def __init__(
        self, choices: Choices, command: Callable[[Choices], str], *, snapshots: Path, recordings: Path, axes: Axes
    ) -> None:
        super().__init__()
        self._command, self._snapshots, self._folder, self._axes = command, snapshots, recordings, axes
        self._recordings = Recordings()
        self._memory = Memory(choices)
        self.feed: Final = BrowserFeed(None)
        self._stop = threading.Event()
        self._has_ended = False

    def sink(self, core: StereoCore | None, links: Sequence[str]) -> PageSink:
        """The run is open: return what takes its results.

        Args:
            core: of the run.
            links: addresses of its board, which may have been found only now.
        """
        self._memory.choose({**self._memory.choices, "link": " ".join(links)})
        return PageSink(self._shelf, core)

    def watch(self, host: Host) -> None:
        """Begin to show the run, which may be recorded from now on.

        Args:
            host: the run.
        """
        self._memory.watch(host.snapshot)
        self._recordings.watch(host)

    def stopped(self) -> bool:
        """Whether the page has stopped the run."""
        return self._stop.is_set()

    def ended(self, snapshot: RunSnapshot) -> None:
        """The run is over: show its last snapshot from now on."""
        self._memory.last(snapshot)
        self._has_ended = True
        self._shelf.tell()

    def state(self) -> PageState:
        """See Source."""
        activity = Activity.RUNNING
        if self._has_ended or self._stop.is_set():
            activity = Activity.IDLE if self._has_ended else Activity.ENDING
        choices = self._memory.choices
        known = PageState(activity=activity, settings=choices, command=self._command(choices))
        return replace(self._memory.state(known), steps=())

    def command(self, command: Command) -> Answer:
        """See Source."""
        if command.do is Do.STOP:
            self._stop.set()
            self.feed.end()
            self._shelf.tell()
            return Answer(words="it is ending")
        try:
            match command.do:
                case Do.SNAPSHOT:
                    return keep_newest(self._shelf, self._snapshots, self._axes)
                case Do.RECORD:
                    return self._recordings.begin(self._folder)
                case Do.END_RECORDING:
                    return self._recordings.end()
                case _:
                    return Answer(trouble=_NEEDS_SERVE)
        except TandemError as error:
            return Answer(trouble=diagnostic_of(error))
        finally:
            self._memory.outdate()

    def saved(self) -> str:
        """See Source."""
        return str(self._snapshots) if self._snapshots.is_dir() else ""

    def surface(self, since: int, most_points: int) -> Surface | None:
        """See Source: a run scans nothing."""
        del since, most_points
        return None

    def scanned(self) -> str:
        """See Source."""
        return ""
