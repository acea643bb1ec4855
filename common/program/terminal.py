"""Fits text to a terminal: a phone's has about 50 columns. Lines that go to a file or a pipe keep their length.

Rule: all that people read goes through `folded`. So no name or value that it quotes can control their terminal, wherever it is shown later.
"""

import os
import re
import sys
import textwrap
from collections.abc import Sequence
from typing import Final, TextIO

from common.plain_text import printable, printable_lines

_COMMAND: Final = re.compile(
    r"(?!\S+(?: \S+)?: error: )\s*(\S+(?: \S+)? {2,})?((?:'[^']*/|\S*/)?(phone-host|board-agent|delay-bench)(?!\S)|(python3?|pipx?|sudo|make|\.) )"
)
"""A line that is a command, maybe behind a label of one or two words. It stays whole, because it is there to be pasted.
An error begins with a command's name too, and maybe a verb's, but with a colon behind it."""

_COLUMN: Final = re.compile(r"\S( {2,})(?=\S)")
_FARTHEST: Final = 0.45
"""Continued lines begin below the text's column if that lies in this part of the terminal."""


def columns(stream: TextIO | None = None) -> int:
    """Return the width of the terminal that a stream writes to, in characters; 0 if it is no terminal."""
    return _size(stream or sys.stdout).columns


def rows(stream: TextIO | None = None) -> int:
    """Return the height of the terminal that a stream writes to, in lines; 0 if it is no terminal."""
    return _size(stream or sys.stdout).lines


def _size(stream: TextIO | None) -> os.terminal_size:
    try:
        return os.get_terminal_size(-1 if stream is None else stream.fileno())
    except (OSError, ValueError):  # no terminal, or no file at all
        return os.terminal_size((0, 0))


def say(text: str | Sequence[str], stream: TextIO | None = None, *, flush: bool = False) -> None:
    """Print text that people read, fitted to the terminal.

    Args:
        text: as lines, each stays one whatever it quotes; as one text, it may hold the ends of lines.
        stream: standard output if left out.
        flush: whether it must be seen now, and not when the program ends.
    """
    lines = text if isinstance(text, str) else "\n".join(map(printable, text))
    stream = stream or sys.stdout
    print(fitted(lines, stream), file=stream, flush=flush)


def headed(text: str, width: int, height: int) -> str:
    """Fold text; where it is higher than the terminal, so that its first line is out of sight, say that line again at the end.

    Args:
        text: lines, the most important one first.
        width: of the terminal; 0: no limit.
        height: of the terminal; 0: no limit.
    """
    whole = folded(text, width)
    # The prompt that follows takes one more line.
    if not height or whole.count("\n") + 2 <= height:
        return whole
    return f"{whole}\n\n{folded(text.partition(chr(10))[0], width)}"


def fitted(text: str, stream: TextIO | None = None) -> str:
    """Fold text to the terminal that a stream writes to; see `folded`."""
    return folded(text, columns(stream))


def folded(text: str, width: int) -> str:
    """Fold lines that are longer than a terminal's at spaces. Words, numbers and paths are never cut, commands stay whole.

    What could control the terminal is shown as Python writes it: an escape becomes its code in letters.

    Args:
        text: lines.
        width: of the terminal; 0: no limit.

    Returns:
        The lines; those that continue one are indented.
    """
    plain = printable_lines(text)
    return "\n".join(_fold(line, width) for line in plain.split("\n")) if width else plain


def _fold(line: str, width: int) -> str:
    if len(line) <= width or _COMMAND.match(line):
        return line
    gaps = [gap.end() for gap in _COLUMN.finditer(line) if gap.end() <= _FARTHEST * width]
    hang = gaps[-1] if gaps else len(line) - len(line.lstrip()) + 2
    return "\n".join(
        textwrap.wrap(
            line,
            width,
            subsequent_indent=" " * hang,
            break_long_words=False,
            break_on_hyphens=False,
            replace_whitespace=False,
            expand_tabs=False,
        )
    )
