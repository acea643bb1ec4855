"""A table of a benchmark's rows, one column for each of their attributes."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_WIDTH = 150


def print_rows(title: str, rows: Sequence["DataclassInstance"]) -> None:
    """Print rows of one kind as a table; without rows, nothing.

    Args:
        title: of the table.
        rows: dataclasses of numbers and words.
    """
    if not rows:
        return
    table = Table(title=title, title_justify="left")
    for name in asdict(rows[0]):
        table.add_column(name.replace("_", " "), justify="right")
    for row in rows:
        table.add_row(*(f"{each:.3f}" if isinstance(each, float) else str(each) for each in asdict(row).values()))
    Console(width=_WIDTH).print(table)
