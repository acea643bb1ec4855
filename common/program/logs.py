"""Logging for shells: key=value to stderr, one line for each change of state, none per frame above DEBUG."""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from common.plain_text import plain_spaces, printable


def set_up(level: int = logging.INFO) -> None:
    """Send this process's log to stderr. journald and terminals add whatever else they need."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)


class _Written(logging.Handler):
    """Gives each line of the log to a function.

    Args:
        write: takes the line, without its end.
    """

    def __init__(self, write: Callable[[str], None]) -> None:
        super().__init__()
        self._write = write

    def emit(self, record: logging.LogRecord) -> None:
        """See logging.Handler."""
        try:
            self._write(self.format(record))
        except Exception:  # noqa: BLE001 - as logging's own handlers: a log line must not end the program
            self.handleError(record)


@contextmanager
def written_by(write: Callable[[str], None]) -> Iterator[None]:
    """Give the log's lines to a function instead of stderr while a block runs: a terminal's picture must know of them.

    Args:
        write: takes one line without its end; called by any thread.
    """
    root = logging.getLogger()
    before = root.handlers[:]
    root.handlers[:] = [_instead(handler, write) for handler in before]
    try:
        yield
    finally:
        root.handlers[:] = before


def _instead(handler: logging.Handler, write: Callable[[str], None]) -> logging.Handler:
    if not isinstance(handler, logging.StreamHandler) or handler.stream is not sys.stderr:
        return handler
    written = _Written(write)
    written.setFormatter(handler.formatter)
    return written


def event(name: str, **fields: object) -> str:
    """Format one change of state as `name key=value …`; values with blanks are quoted."""
    return " ".join([name, *(f"{key}={_value(value)}" for key, value in fields.items())])


def _value(value: object) -> str:
    text = plain_spaces(str(value)).replace("\n", " ")
    return repr(text) if " " in text or not text else printable(text)
