"""How deeply a YAML text nests, before a parser sees it: OpenCV's calls itself for each level, and a deep file overflows its stack. Pure.

The depth is never less than the parser's, whatever the text is, and as a rule the same. So:
- an opening bracket always counts, even in quotes or in a key;
- a closing one counts only where it cannot be part of a text: on a line without quotes and comments, behind the last colon;
- what a line leaves open ends at the next line that begins in the first column, because there the parser allows no inner value.
"""

import re
from typing import Final

MOST_LEVELS: Final = 64
"""A rig.yaml has three levels. OpenCV's parser survives 20000 on a stack of 8 MB."""

_BLOCK: Final = re.compile(r":|-(?![\d.])")
"""Begins a value that may itself be a map or a list; a sign before a number does not."""


def is_too_deep(text: str) -> bool:
    """Return whether a YAML text may nest more than `MOST_LEVELS` levels deep."""
    brackets = 0
    columns: list[int] = []  # of the maps and lists without brackets that are open
    for line in re.split(r"[\r\n]", text):
        words = line.lstrip(" ")
        if not words or words.startswith("#"):
            continue
        column = len(line) - len(words)
        if column == 0:
            brackets = 0
        while columns and columns[-1] >= column:
            columns.pop()
        columns.append(column)
        if words != "---":
            columns.extend(column + mark.end() for mark in _BLOCK.finditer(words))
        brackets += words.count("[") + words.count("{")
        if brackets + len(columns) > MOST_LEVELS:
            return True
        if not re.search(r"[\"'#]", words):
            after = words.rpartition(":")[2]
            brackets = max(0, brackets - after.count("]") - after.count("}"))
    return False
