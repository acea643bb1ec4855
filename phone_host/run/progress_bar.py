"""A progress bar that fits its terminal: on a phone's, the words wrap and the bar makes room, so that no number is cut."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Column

_WIDE: Final = 76
"""Characters for the longest description (40), a bar and two numbers."""


def progress_bar(console: Console) -> Progress:
    """Make a progress bar with percentage and time left; it is hidden where the console is no terminal and gone when it ends.

    Args:
        console: where to draw.
    """
    narrow = console.width < _WIDE
    words = TextColumn("{task.description}", table_column=Column(ratio=1) if narrow else None)
    bar: list[ProgressColumn] = [] if narrow else [BarColumn()]
    numbers = (
        TaskProgressColumn(table_column=Column(no_wrap=True, min_width=4)),
        TimeRemainingColumn(table_column=Column(no_wrap=True, min_width=7)),
    )
    return Progress(
        words, *bar, *numbers, console=console, transient=True, disable=not console.is_terminal, expand=narrow
    )


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


@contextmanager
def busy_bar(what: str, console: Console | None = None) -> Iterator[None]:
    """Show on stderr that something goes on while a block runs, if nobody knows how long it takes.

    Args:
        what: what is being done.
        console: where to draw; stderr by default.
    """
    shown = console or Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn())
    with Progress(*columns, console=shown, transient=True, disable=not shown.is_terminal) as progress:
        progress.add_task(what, total=None)
        yield
