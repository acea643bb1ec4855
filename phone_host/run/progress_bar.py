"""The progress bar of long work: what is being done, how much of it, and the time left. On stderr, on a terminal only.

It fits its terminal: on a phone's, the words wrap and the bar makes room, so that no number is cut.
"""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from typing import Final, assert_never

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

from common.program.terminal import say

_AGAIN_S: Final = 8.0
"""Who reads a log learns so often that a stage still goes on: on a loaded machine, too, no ten seconds pass without a line."""

_WIDE: Final = 76
"""Characters for the longest description (40), a bar and two numbers."""


class Amount(Enum):
    """How a bar tells how much is done: a share and the time left, units and the time left, or only the time that has passed."""

    SHARE = "share"
    UNITS = "units"
    UNKNOWN = "unknown"


def progress_bar(console: Console, amount: Amount = Amount.SHARE) -> Progress:
    """Make a progress bar; it is hidden where the console is no terminal, and gone when it ends."""
    narrow = console.width < _WIDE
    words = TextColumn("{task.description}", table_column=Column(ratio=1) if narrow else None)
    bar: list[ProgressColumn] = [] if narrow else [BarColumn()]
    return Progress(
        words, *bar, *_numbers(amount), console=console, transient=True, disable=not console.is_terminal, expand=narrow
    )


def _numbers(amount: Amount) -> tuple[ProgressColumn, ...]:
    left = TimeRemainingColumn(table_column=Column(no_wrap=True, min_width=7)), TextColumn("left")
    match amount:
        case Amount.SHARE:
            return TaskProgressColumn(table_column=Column(no_wrap=True, min_width=4)), *left
        case Amount.UNITS:
            return MofNCompleteColumn(table_column=Column(no_wrap=True)), *left
        case Amount.UNKNOWN:
            return (TimeElapsedColumn(table_column=Column(no_wrap=True, min_width=7)),)
        case _:
            assert_never(amount)


@contextmanager
def announced(
    stage: str, console: Console, done: Callable[[], str] = lambda: "it goes on", again_s: float = _AGAIN_S
) -> Iterator[None]:
    """Say in lines that a stage begins and how far it is, where its bar is hidden: in a pipe, a log or a service.

    Args:
        stage: what is being done while the block runs.
        console: where its bar is drawn.
        done: how far it is; called from another thread.
        again_s: time between two lines, s.
    """
    if console.is_terminal:
        yield
        return
    over = threading.Event()

    def line(words: str) -> None:
        print(f"phone-host: {words}", file=console.file, flush=True)

    def say_again() -> None:
        while not over.wait(again_s):
            line(f"{stage}: {done()}")

    line(stage)
    thread = threading.Thread(target=say_again, name="stage", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def tell(line: str) -> None:
    """Print a line that the user should know on stderr."""
    say(f"phone-host: {line}", sys.stderr, flush=True)


class ShareBar:
    """A bar that is set to a share of the work.

    Args:
        progress: the bar it is drawn in.
        task: the bar's task.
        then: what to say once the work has begun to advance; empty: what was said before.
    """

    def __init__(self, progress: Progress, task: TaskID, then: str) -> None:
        self._progress, self._task, self._then = progress, task, then

    def __call__(self, share: float) -> None:
        """Show that so much is done, 0 to 1."""
        if share > 0 and self._then:
            self._progress.reset(self._task, description=self._then, total=1.0)  # the time left counts from here
            self._then = ""
        self._progress.update(self._task, completed=share)

    def say(self, what: str) -> None:
        """Show what is being done from now on."""
        self._progress.update(self._task, description=what)


@contextmanager
def share_bar(what: str, then: str = "", console: Console | None = None) -> Iterator[ShareBar]:
    """Show a bar on stderr while a block runs.

    Args:
        what: what is being done, such as "waiting for the board".
        then: what is being done once it advances, such as "filming"; empty: the same.
        console: where to draw; stderr by default.

    Yields:
        The function to call with the share that is done, 0 to 1.
    """
    with progress_bar(console or Console(stderr=True)) as progress:
        task = progress.add_task(what, total=None if then else 1.0)
        yield ShareBar(progress, task, then)


class StepBar:
    """A bar that counts units of work."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self._task = progress, task

    def __call__(self, amount: int = 1) -> None:
        """Count so many units as done."""
        self._progress.advance(self._task, amount)

    def say(self, what: str) -> None:
        """Show what is being done from now on."""
        self._progress.update(self._task, description=what)


@contextmanager
def step_bar(what: str, total: int | None, console: Console | None = None) -> Iterator[StepBar]:
    """Show a bar on stderr while a block runs.

    Args:
        what: what is being done, such as "finding the board".
        total: the units of work; None: not known, so only the time that has passed is shown.
        console: where to draw; stderr by default.

    Yields:
        The function to call after each unit.
    """
    amount = Amount.UNKNOWN if total is None else Amount.UNITS
    with progress_bar(console or Console(stderr=True), amount) as progress:
        yield StepBar(progress, progress.add_task(what, total=total))


@contextmanager
def busy_bar(what: str, console: Console | None = None) -> Iterator[None]:
    """Show on stderr that something goes on while a block runs, if nobody knows how long it takes.

    Args:
        what: what is being done.
        console: where to draw; stderr by default.
    """
    with step_bar(what, None, console):
        yield
