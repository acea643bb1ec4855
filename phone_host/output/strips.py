"""Divides images into strips of rows. Pure.

A strip and what is made of it stay in the processor's cache, and no second copy of a large image is needed.
"""

from collections.abc import Iterator
from typing import Final

_VALUES: Final = 1 << 18
"""Values of a strip: 1 MB of float32, as much as a small processor's cache holds."""


def strips(rows: int, values_per_row: int) -> Iterator[slice]:
    """Yield slices of rows from top to bottom, of about as many values each."""
    step = max(1, _VALUES // max(1, values_per_row))
    for top in range(0, rows, step):
        yield slice(top, min(top + step, rows))
