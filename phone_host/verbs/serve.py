"""phone-host serve: the page, which leads from nothing to a run."""

import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO

from common.errors import TakenError
from common.plain_text import printable
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.interrupts import leave
from common.program.request import Request, option
from common.program.signals import StopSignals
from common.program.terminal import columns, say
from common.words import counted
from phone_host.diagnostics.headline import headline
from phone_host.jobs.options import LAN_HELP
from phone_host.output.json_text import json_text
from phone_host.serve.commands import Commands
from phone_host.serve.page import first_url, open_browser, page_settings, served, tell_page
from phone_host.serve.station import Station
from phone_host.settings import usual_file
from phone_host.web.settings import PageSettings
from phone_host.web.source import Activity, PageState

EXAMPLES = """  phone-host serve --open    # the page in this machine's browser
  phone-host serve 127.0.0.1:9000
  phone-host serve --lan    # for a phone in the same network: https, with a code to scan
"""

_STEP_S: Final = 0.25
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeRequest(Request):
    """What the page's server can be told."""

    address: str | None = option(
        nargs="?",
        metavar="HOST:PORT",
        help="where the page is served (default 127.0.0.1:8765; with --lan 0.0.0.0:8765); port 0: any that is free",
    )
    open: bool = option("--open", action="store_true", help="open the page in the browser")
    lan: bool = option("--lan", action="store_true", help=LAN_HELP)
    config: Path | None = option(
        "--config",
        type=Path,
        metavar="FILE",
        help="settings file in which the page keeps what is chosen (default ~/.config/tandemscan/phone-host.toml)",
    )
    keys: str | None = option("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")


def run(request: ServeRequest) -> int:
    """Serve the page until stopped."""
    status = Status(sys.stderr)
    commands = Commands(
        request.config or usual_file(), request.keys, lambda line: say(f"phone-host: {line}", sys.stderr)
    )
    logs.set_up(commands.log_level)
    settings = page_settings(request.address, commands.keys.path, lan=request.lan)
    station = Station(commands)
    signals = StopSignals()
    with _opened_if_taken(settings, is_asked=request.open), served(station, settings) as server:
        url = first_url(server, settings)
        print(json_text({"url": url}) if request.as_json else f"phone-host: the page: {url}", flush=True)
        tell_page(server, settings)
        if request.open:
            open_browser(url)
        while not signals.stop:
            status.show(station.state())
            select.select([signals.reader], [], [], _STEP_S)
        status.clear()
        station.close()
    if signals.interrupted and station.has_given_up:
        leave()  # the interpreter's end would wait for native code
    return INTERRUPTED if signals.interrupted else 0


@contextmanager
def _opened_if_taken(settings: PageSettings, *, is_asked: bool) -> Iterator[None]:
    """Where a page is served already, as by the service, open that one. It gets no token: who knows who serves there."""
    try:
        yield
    except TakenError:
        if is_asked:
            scheme = "http" if settings.credentials is None else "https"
            open_browser(f"{scheme}://127.0.0.1:{settings.port}/")
        raise


def activity_text(state: PageState) -> str:
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
                say(f"phone-host: {activity_text(state)}", self._stream, flush=True)
            return
        if state.activity is Activity.CALIBRATING:  # its bars are drawn here
            self.clear()
            return
        line = f"phone-host: {activity_text(state)}"[: max(columns(self._stream) - 1, 20)]
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
