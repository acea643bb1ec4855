"""A progress bar that fits its terminal: on a phone's, the words wrap and the bar makes room, so that no number is cut."""

from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
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
