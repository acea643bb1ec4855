"""The page's root: it leads from nothing to a run. One activity at a time, each in a thread of its own; whatever fails, the page lives.

page ── Source ── Station ─┬ Activities: enrol | check | calibrate | run, in a thread
├ Shelf: the newest results, from the run's sink
└ Commands: what is chosen, and the jobs that are begun with it
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from threading import Lock
from typing import Final, TypeVar

from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import SettingsError, TandemError
from common.link.enrolment_door import pairing_address
from common.link.factory import parse_link
from common.protocol.enrolment_code import read_code
from common.words import counted
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.discovery.enrolment import PairingCall
from phone_host.doctor.host_doctor import examine
from phone_host.jobs.calibrate.view import SnapshotValues
from phone_host.jobs.run import PreparedRun
from phone_host.run.kept import give_back_freed_memory
from phone_host.serve import check, find
from phone_host.serve.activities import Activities, Task
from phone_host.serve.choices import Choices
from phone_host.serve.commands import Commands
from phone_host.serve.memory import Memory
from phone_host.serve.point_answer import ShelfSource
from phone_host.serve.saved import Recordings, keep_newest, page_folder
from phone_host.serve.scanning import Scanning, scanned
from phone_host.serve.shelf import PageSink
from phone_host.serve.workshop import Workshop
from phone_host.stereo.core import StereoCore
from phone_host.web.source import (
    Activity,
    Answer,
    Command,
    Do,
    PageState,
    ScanState,
    Surface,
)

_END_S: Final = 20.0
"""A run that ends writes its report; a slow card takes seconds for that."""

_DOOR_S: Final = 3.0
"""Whoever types a code stands before the board: its door is open, or it is not."""

_ANSWER_S: Final = 12.0
"""The door's own patience, and a little more."""


_Asked = TypeVar("_Asked")


class Station(ShelfSource):
    """The source behind the page of `serve`.

    Args:
        commands: what is chosen, and the jobs that are begun with it.
    """

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        kept = commands.kept
        self._memory = Memory(kept)
        self._choosing = Lock()
        self._recordings, self._scanning = Recordings(), Scanning()
        self._workshop = Workshop(self._changed)
        self._activities = Activities(self._begins, self._shelf.tell, self._memory.fail)
        self._do: dict[Do, Callable[[Choices], Answer]] = {
            Do.FIND: self._find,
            Do.ENROL: self._enrol,
            Do.SET: self._set,
            Do.CHECK: self._check,
            Do.CAPTURE: self._capture,
            Do.CALIBRATE: self._calibrate,
            Do.RUN: self._run,
            Do.SCAN: self._scan,
            Do.CROP: lambda values: Answer(words=self._scanning.crop(values.get("box", ""))),
            Do.STOP: self._stop,
            Do.SNAPSHOT: self._snapshot,
            Do.RECORD: self._record,
            Do.END_RECORDING: self._end_recording,
            Do.CHECK_MODEL: lambda values: self._made(self._workshop.check, self._commands.print_wanted(values)),
            Do.SAVE_MODEL: lambda values: self._made(self._workshop.save, values.get("format", "")),
            Do.PREPARE_PRINT: lambda values: self._made(self._workshop.prepare, self._commands.print_wanted(values)),
            Do.PRINT: lambda values: Answer(words=self._workshop.start(values.get("confirm", ""))),
            Do.PAUSE_PRINT: lambda _: Answer(words=self._workshop.pause()),
            Do.CANCEL_PRINT: lambda _: Answer(words=self._workshop.cancel()),
        }
        try:
            commands.changed(kept, kept)
        except TandemError as error:  # somebody else has changed the file, or what it names has gone
            self._memory.fail(diagnostic_of(error))

    @property
    def feed(self) -> BrowserFeed:
        """See Source."""
        return self._commands.feed

    def state(self) -> PageState:
        """See Source."""
        choices = self._memory.choices
        known = PageState(
            activity=self._activities.now,
            settings=self._commands.shown(choices),
            command=self._commands.command(choices) if choices.get("camera") else "",
            matchers=self._commands.matchers,
            stranger=self._stranger(choices.get("link", "")),
            scan=self._scanned_state(),
            scan_command=self._commands.scan_command(choices),
            printing=self._workshop.state,
        )
        return self._memory.state(known, find.browser_choice(self.feed.words))

    def _scanned_state(self) -> ScanState | None:
        """Return how the scan goes; with the files that were saved of it since."""
        state = self._scanning.state
        return state and replace(state, files=(*state.files, *self._workshop.saved(state.folder)))

    def command(self, command: Command) -> Answer:
        """See Source."""
        try:
            return self._do[command.do](command.values)
        except TandemError as error:
            return Answer(trouble=diagnostic_of(error))
        finally:
            self._memory.outdate()
            self._shelf.tell()

    def surface(self, since: int, most_points: int) -> Surface | None:
        """See Source."""
        return self._scanning.surface(since, most_points)

    def scanned(self) -> str:
        """See Source."""
        return self._scanning.folder

    def saved(self) -> str:
        """See Source."""
        folder, _ = self._commands.snapshots(self._memory.choices)
        return str(folder) if folder.is_dir() else ""

    def close(self) -> None:
        """End what goes on, in order."""
        self._activities.close(_END_S)
        self._workshop.close()

    @property
    def has_given_up(self) -> bool:
        """Whether native code still computes a pair that nobody waits for. The process may have to end without it."""
        return self._memory.has_given_up

    def _changed(self) -> None:
        self._memory.outdate()
        self._shelf.tell()

    def _made(self, does: Callable[[str, _Asked], str], asked: _Asked) -> Answer:
        """Do something with the last scan."""
        return Answer(words=does(self._scanning.folder, asked))

    def _begins(self) -> None:
        self._memory.begin()
        self._shelf.clear()
        give_back_freed_memory()

    def _stranger(self, links: str) -> str:
        try:
            return find.stranger(links, self._commands.keys.peers())
        except TandemError:  # a run with these settings says what is wrong
            return ""

    def _find(self, values: Choices) -> Answer:
        del values
        boards, cameras = find.find_boards(self._commands.keys), find.find_cameras()
        self._memory.found(boards, cameras)
        taken = [
            name
            for name, there in (("link", boards), ("camera", cameras))
            if len(there) == 1 and not self._memory.choices.get(name)
        ]
        only = {name: (boards if name == "link" else cameras)[0].uri for name in taken}
        if only:
            self._choose(only)
        told = f"found {counted(len(boards), 'board')} and {counted(len(cameras), 'camera')}"
        return Answer(words=f"{told}; the only one is chosen" if only else told)

    def _enrol(self, values: Choices) -> Answer:
        link, code = values.get("link", ""), read_code(values.get("code", ""))
        uri = parse_link(link, listens_by_default=False)
        if not uri.address.startswith("tcp://") or uri.listens:
            raise SettingsError(f"link {link!r} needs no code", "choose it, and check")

        def work(task: Task) -> None:
            call = PairingCall(pairing_address(uri.address), self._commands.keys, uri.address, patience_s=_DOOR_S)
            call.ask()
            if task.stopped():
                return
            peer = call.prove(code, uri.address, lambda: None)
            self._memory.enrolled(uri.address, peer.name)
            if uri.address not in self._memory.choices.get("link", "").split():
                self._choose({"link": uri.address})

        return self._begun(Activity.ENROLLING, work, "the board is enrolled", _ANSWER_S)

    def _set(self, values: Choices) -> Answer:
        self._choose(values)
        done = "set" if any(value.strip() for value in values.values()) else "removed"
        is_busy = self._activities.now is not Activity.IDLE
        return Answer(words=f"{done}; it takes effect with the next run: stop, then start" if is_busy else done)

    def _choose(self, changes: Choices) -> None:
        """Change choices and keep them.

        Raises:
            SettingsError: they are not valid, or cannot be kept.
        """
        with self._choosing:  # two pages may set something at the same moment
            new = self._commands.changed(self._memory.choices, changes)
            self._commands.keep(new)
            self._memory.choose(new)

    def _check(self, values: Choices) -> Answer:
        del values
        choices = self._both_chosen()

        def work(task: Task) -> None:
            findings = []
            for finding in examine(self._commands.question(choices)):
                if task.stopped():
                    return
                findings.append(finding)
                self._memory.checking(check.checked(check.relevant(findings, choices["link"])))
            if (trouble := check.obstacle(findings)) is not None:
                self._memory.fail(trouble)
                return
            over = self._watched(task, self._commands.trial(choices, self._sinks))
            self._memory.forget_run()
            if task.stopped():
                return
            if told := check.seen(over):
                self._memory.checked(choices, told)
            else:
                self._memory.fail(check.unseen(over))

        return self._begun(Activity.CHECKING, work, "the check begins")

    def _capture(self, values: Choices) -> Answer:
        del values
        choices = self._memory.choices
        if not choices.get("camera"):
            raise SettingsError("no camera of this machine is chosen", "find one, or type its address")

        def work(task: Task) -> None:
            guide, found = check.CaptureGuide(self._show_checks), list[Diagnostic]()
            guide.wait()
            try:
                with task.held():
                    findings = self._commands.capture(choices, task.stopped, guide.tell)
                found = [] if task.stopped() else check.checked(findings)
            finally:
                self._show_checks(found)  # whatever ended it: nobody is to hold the camera any more

        return self._begun(Activity.CHECKING, work, "hold the camera still")

    def _show_checks(self, checks: Sequence[Diagnostic]) -> None:
        self._memory.checking(checks)
        self._shelf.tell()

    def _calibrate(self, values: Choices) -> Answer:
        choices = self._both_chosen()

        def work(task: Task) -> None:
            ready = self._commands.calibration(choices, values, self._sinks(None))
            shown = SnapshotValues(self._show_guide)
            try:
                with task.held(), self._memory.live(ready.views.live.host.snapshot):
                    ready.views.run(task.stopped, (shown,))
            finally:
                self._shelf.clear()  # these pairs are not those of a run
            if task.stopped():
                views = counted(ready.views.live.snapshot().views, "view")
                self._memory.calibration_stopped(f"stopped: {views} saved, no calibration computed")
                return
            done = ready.finish(task.go_on)
            if done.rig is not None:
                self._choose({"calibration": str(done.rig), "rectified": ""})
            self._memory.calibrated(done.words, done.trouble)

        return self._begun(Activity.CALIBRATING, work, "the calibration begins: show the board to both cameras")

    def _show_guide(self, _snapshot: GuideSnapshot, values: Mapping[str, object]) -> None:
        self._memory.guide(values)
        self._shelf.tell()

    def _run(self, values: Choices) -> Answer:
        del values
        choices = self._both_chosen()

        def work(task: Task) -> None:
            over = self._watched(task, self._commands.run(choices, self._sinks))
            if not task.is_left:
                self._memory.ran(over.processed)

        return self._begun(Activity.RUNNING, work, "the run begins")

    def _scan(self, values: Choices) -> Answer:
        choices = self._both_chosen()

        def work(task: Task) -> None:
            scan = self._commands.scan(choices, values, self._sinks)
            host = scan.host
            with (
                task.held(),
                self._memory.live(host.snapshot),
                self._scanning.shown(scan.live, self._memory.begun, values),
            ):
                try:
                    report, snapshot = scan.ended(host.run(task.stopped))
                except Exception:
                    early = scan.failed()
                    self._scanning.over(None if early is None else scanned(early, scan.out, is_early=True))
                    raise
            self._memory.last(snapshot)
            self._memory.gave_up(host.has_given_up)
            self._scanning.over(scanned(report, scan.out))

        return self._begun(Activity.SCANNING, work, "the scan begins")

    def _watched(self, task: Task, ready: PreparedRun) -> RunSnapshot:
        """Run, show it, and write its report; return its last snapshot."""
        with task.held(), self._memory.live(ready.host.snapshot), self._recordings.beside(ready.host):
            try:
                ended = ready.host.run(task.stopped)
            except Exception as error:
                with suppress(Exception):  # tell what ended the run, not what followed
                    self._memory.last(ready.failed(diagnostic_of(error)).snapshot)
                raise
            over = ready.ended(ended)
        give_back_freed_memory()
        self._memory.last(over.snapshot)
        self._memory.gave_up(ready.host.has_given_up)
        if over.missing:
            self._memory.fail(Diagnostic(f"not written: {over.missing}", "make room and run again", Severity.FAIL))
        return over.snapshot

    def _stop(self, values: Choices) -> Answer:
        del values
        if not self._activities.stop():
            return Answer(words="nothing is running")
        return Answer(words="stopped" if self._activities.now is Activity.IDLE else "it is ending")

    def _snapshot(self, values: Choices) -> Answer:
        del values
        return keep_newest(self._shelf, *self._commands.snapshots(self._memory.choices))

    def _record(self, values: Choices) -> Answer:
        del values
        return self._recordings.begin(page_folder(self._memory.choices.get("out"), "recordings"))

    def _end_recording(self, values: Choices) -> Answer:
        del values
        return self._recordings.end()

    def _sinks(self, core: StereoCore | None) -> tuple[PageSink, ...]:
        return (PageSink(self._shelf, core, self._memory.begun),)

    def _both_chosen(self) -> Choices:
        choices = self._memory.choices
        for name, what in (("link", "board"), ("camera", "camera of this machine")):
            if not choices.get(name):
                raise SettingsError(f"no {what} is chosen", "find one, or type its address")
        return choices

    def _begun(self, activity: Activity, work: Callable[[Task], None], words: str, patience_s: float = 0.0) -> Answer:
        """Begin an activity; wait for its end, if it is short.

        Args:
            activity: which one.
            work: does it.
            words: what to answer.
            patience_s: wait so long for its end, s.
        """
        trouble = self._activities.begin(activity, work)
        if trouble is None and patience_s:
            self._activities.wait(patience_s)
            trouble = self._memory.trouble
        return Answer(words="" if trouble else words, trouble=trouble)
