"""What the station knows beside images: choices, what was found, how the last activities went. Any thread may use it."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from common import now
from common.diagnostic import Diagnostic
from phone_host.calibration.guide.snapshot import Ended
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.serve.choices import Choices
from phone_host.serve.steps import steps
from phone_host.web.source import Activity, Choice, PageState

_FRESH_NS: Final = 150_000_000
"""A snapshot of a run serves so long: however often the state is asked for, the run is read a few times a second."""


class Memory:
    """The station's memory.

    Args:
        choices: with which it begins.
    """

    def __init__(self, choices: Choices) -> None:
        self._lock = threading.RLock()
        self._choices: Choices = dict(choices)
        self._boards: tuple[Choice, ...] | None = None
        self._cameras: tuple[Choice, ...] | None = None
        self._checks: tuple[Diagnostic, ...] = ()
        self._checked: tuple[Choices, str] = ({}, "")
        self._pairs = 0
        self._begun = 0
        self._trouble: Diagnostic | None = None
        self._guide: Mapping[str, object] | None = None
        self._ask: Callable[[], RunSnapshot] | None = None
        self._run: RunSnapshot | None = None
        self._read_ns = 0
        self._changed = 0
        self._was: PageState | None = None
        self.has_given_up = False

    @property
    def choices(self) -> Choices:
        """The choices now."""
        return self._choices

    @property
    def begun(self) -> int:
        """How many activities have begun."""
        return self._begun

    @property
    def trouble(self) -> Diagnostic | None:
        """What went wrong last."""
        return self._trouble

    def choose(self, choices: Choices) -> None:
        """Take new choices. What went wrong with others concerns nobody any more."""
        if choices != self._choices:
            self._choices, self._trouble = dict(choices), None

    def found(self, boards: tuple[Choice, ...], cameras: tuple[Choice, ...]) -> None:
        """Take what was found."""
        self._boards, self._cameras = boards, cameras

    def enrolled(self, link: str, name: str) -> None:
        """A board knows this machine now."""
        others = tuple(board for board in self._boards or () if board.uri != link)
        self._boards = (Choice(uri=link, name=name), *others)

    def checking(self, checks: Sequence[Diagnostic]) -> None:
        """Take what a check has found so far."""
        self._checks = tuple(checks)

    def checked(self, choices: Choices, words: str) -> None:
        """Both cameras are as they should be."""
        self._checked = (_cameras_of(choices), words)

    def ran(self, pairs: int) -> None:
        """A run has processed so many pairs."""
        self._pairs = pairs

    def guide(self, content: Mapping[str, object]) -> None:
        """Take what the live calibration shows."""
        self._guide = content

    def calibrated(self, words: str, trouble: Diagnostic | None) -> None:
        """Take what a calibration came to, and why there is no rig of use; its words stay with the guide."""
        self._guide, self._trouble = {**(self._guide or {}), "result": words}, trouble

    def calibration_stopped(self, words: str) -> None:
        """Take in one sentence how far a live calibration came that was stopped: its verdict so far is not that of a rig."""
        self._guide = {**(self._guide or {}), "result": words, "state": Ended.STOPPED.value}

    def fail(self, trouble: Diagnostic) -> None:
        """Something went wrong."""
        self._trouble = trouble

    def begin(self) -> None:
        """Something new begins: the last run, and what went wrong, concern nobody any more."""
        with self._lock:
            self._trouble = self._run = None
            self._begun += 1

    def gave_up(self, given_up: bool) -> None:  # noqa: FBT001 - the host's own value
        """Note whether native code is left behind."""
        self.has_given_up = self.has_given_up or given_up

    def watch(self, ask: Callable[[], RunSnapshot]) -> None:
        """From now on the run can be asked.

        Args:
            ask: returns the run's snapshot.
        """
        with self._lock:
            self._ask, self._read_ns = ask, 0

    def outdate(self) -> None:
        """A command was done: whoever asks next gets the run after it."""
        self._read_ns = 0

    @contextmanager
    def live(self, ask: Callable[[], RunSnapshot]) -> Iterator[None]:
        """While the block runs, the run can be asked; after it nothing is shown of it, unless `last` took its end.

        Args:
            ask: returns the run's snapshot.
        """
        self.watch(ask)
        try:
            yield
        finally:
            with self._lock:
                if self._ask is ask:
                    self._ask = self._run = None

    def last(self, snapshot: RunSnapshot) -> None:
        """Take the last snapshot of a run."""
        with self._lock:
            self._ask, self._run = None, snapshot

    def forget_run(self) -> None:
        """Show nothing of the last run: it was none whose depth matters."""
        with self._lock:
            self._run = None

    def state(self, known: PageState, browser: Choice | None = None) -> PageState:
        """Return everything.

        Args:
            known: what others know: activity, choices as they may be shown, command lines, matchers, the stranger, scan and print.
            browser: the camera of whichever browser gives one; None: no browser can.
        """
        with self._lock:
            same = self._checked[0] == _cameras_of(self._choices)
            told = steps(
                known.settings,
                stranger=known.stranger,
                checked=self._checked[1] if same else "",
                pairs=self._pairs,
                is_running=known.activity is Activity.RUNNING,
                scan="" if known.scan is None else known.scan.words,
                has_scan=known.scan is not None and bool(known.scan.folder),
            )
            made = replace(
                known,
                steps=told,
                boards=self._boards,
                cameras=self._cameras if browser is None else (*(self._cameras or ()), browser),
                checks=self._checks,
                trouble=self._trouble,
            )
            if made != self._was:
                self._was, self._changed = made, self._changed + 1
            return replace(made, run=self._fresh(), guide=self._guide, changed=self._changed, begun=self._begun)

    def _fresh(self) -> RunSnapshot | None:
        now_ns = now.monotonic_ns()
        if self._ask is not None and now_ns - self._read_ns > _FRESH_NS:
            self._run, self._read_ns = self._ask(), now_ns
        return self._run


def _cameras_of(choices: Choices) -> Choices:
    return {name: choices[name] for name in ("link", "camera") if name in choices}
