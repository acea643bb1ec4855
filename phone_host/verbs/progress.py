"""Shows on a terminal how far long work is: what is being done, a bar, how much of it, and the time left."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn


class Step(Protocol):
    """Reports that some of the work is done."""

    def __call__(self, amount: int = 1) -> None:
        """Count so many units of work as done."""


@contextmanager
def progress(what: str, total: int | None) -> Iterator[Step]:
    """Show a bar on stderr while a block runs; nothing if stderr is no terminal. The bar is gone afterwards.

    Args:
        what: what is being done, such as "finding the board".
        total: the units of work; None: not known, so only that it goes on is shown.

    Yields:
        The function to call after each unit.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        MofNCompleteColumn(),
        TimeRemainingColumn(compact=True),
        TextColumn("left"),
        console=console,
        transient=True,
        expand=True,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task(what, total=total)

        def step(amount: int = 1) -> None:
            bar.advance(task, amount)

        yield step
