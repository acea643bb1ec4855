"""Shows on a terminal how far long work is: what is being done, a bar, how much of it, and the time left."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class Step(Protocol):
    """Reports how far the work is."""

    def __call__(self, amount: int = 1) -> None:
        """Count so many units of work as done."""

    def say(self, what: str) -> None:
        """Show what is being done from now on."""


class _Bar:
    def __init__(self, bar: Progress, what: str, total: int | None) -> None:
        self._bar, self._task = bar, bar.add_task(what, total=total)

    def __call__(self, amount: int = 1) -> None:
        self._bar.advance(self._task, amount)

    def say(self, what: str) -> None:
        self._bar.update(self._task, description=what)


@contextmanager
def progress(what: str, total: int | None) -> Iterator[Step]:
    """Show a bar on stderr while a block runs; nothing if stderr is no terminal. The bar is gone afterwards.

    Args:
        what: what is being done, such as "finding the board".
        total: the units of work; None: not known, so only that it goes on is shown, and for how long.

    Yields:
        The function to call after each unit.
    """
    console = Console(stderr=True)
    end = (
        (TimeElapsedColumn(),)
        if total is None
        else (MofNCompleteColumn(), TimeRemainingColumn(compact=True), TextColumn("left"))
    )
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        *end,
        console=console,
        transient=True,
        expand=True,
        disable=not console.is_terminal,
    )
    with bar:
        yield _Bar(bar, what, total)
