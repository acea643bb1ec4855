"""Single keys while something goes on, where stdin is a terminal."""

import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def keypad() -> Iterator[Callable[[], str]]:
    """While the block runs, keys need no Enter; Ctrl-C stays what it is.

    Yields:
        A function that returns the key that was pressed; empty: none.
    """
    if not sys.stdin.isatty():
        yield lambda: ""
        return
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield _pressed
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _pressed() -> str:
    ready, _, _ = select.select([sys.stdin], [], [], 0)
    return sys.stdin.read(1).lower() if ready else ""
