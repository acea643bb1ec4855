"""What the terminal tells of a page: one line that is redrawn, or, where there is no terminal, a line for each change."""

import sys
from typing import Final, TextIO

from common.plain_text import printable
from common.program.terminal import columns, say
from common.words import counted
from phone_host.diagnostics.headline import headline
from phone_host.web.source import Activity, PageState

_WORDS: Final = {
    Activity.IDLE: "ready",
    Activity.ENROLLING: "enrolling a board",
    Activity.CHECKING: "checking both cameras",
    Activity.CALIBRATING: "calibrating",
    Activity.RUNNING: "running",
    Activity.SCANNING: "scanning",
    Activity.ENDING: "ending",
}
_CLEAR: Final = "\r\x1b[K"


def told(state: PageState) -> str:
    """Return what goes on, in one line."""
    words = _WORDS[state.activity]
    if state.activity is Activity.RUNNING and state.run is not None:
        run = state.run
        words += f": {counted(run.processed, 'pair')}" if run.processed else ": no pair yet"
        words += f"; {headline(run).sentence}" if run.images.wants_depth and run.images.judged else ""
    if state.activity is Activity.SCANNING and state.scan is not None:
        words += f": {state.scan.words}"
    if state.trouble is not None and state.activity is Activity.IDLE:
        words += f"; {state.trouble.message}: {state.trouble.remedy}"
    return printable(words)


class Status:
    """Tells what goes on.

    Args:
        stream: where to.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._last = stream, ""
        self._is_terminal = stream.isatty()
        self._is_drawn = False

    def show(self, state: PageState) -> None:
        """Show the present state; called several times a second."""
        if not self._is_terminal:
            change = f"{_WORDS[state.activity]} {state.trouble}"
            if change != self._last:
                self._last = change
                say(f"phone-host: {told(state)}", self._stream, flush=True)
            return
        if state.activity is Activity.CALIBRATING:  # its bars are drawn here
            self.clear()
            return
        line = f"phone-host: {told(state)}"[: max(columns(self._stream) - 1, 20)]
        if line != self._last or not self._is_drawn:
            self._last, self._is_drawn = line, True
            self._stream.write(f"{_CLEAR}{line}")
            self._stream.flush()

    def clear(self) -> None:
        """Take the line away."""
        if self._is_drawn:
            self._is_drawn = False
            self._stream.write(_CLEAR)
            self._stream.flush()


def stderr_status() -> Status:
    """Return what tells on stderr."""
    return Status(sys.stderr)
