"""Reads the numbers in file names, and sorts by them. Light.

Only the digits 0 to 9 number a file. Others (², ①, ٣) are letters here: Python takes them for digits in one place and not in the next.
"""

import re
from pathlib import Path
from typing import Final

DIGITS: Final = re.compile(r"[0-9]+")

_PARTS: Final = re.compile(r"([0-9]+)")


def name_order(path: Path) -> tuple[list[tuple[int, int | str]], str]:
    """Sort key that treats numbers in names as numbers: frame2 before frame10."""
    parts = _PARTS.split(path.name)  # every other one is a number
    return [(0, int(part)) if at % 2 else (1, part) for at, part in enumerate(parts) if part], str(path)
