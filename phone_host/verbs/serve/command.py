"""phone-host serve: the page, which leads from nothing to a run."""

import argparse
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from common.errors import TakenError
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.interrupts import leave
from common.program.signals import StopSignals
from common.program.terminal import say
from phone_host.output.json_text import json_text
from phone_host.serve.station import Station
from phone_host.settings import usual_file
from phone_host.verbs.serve.page import first_url, open_browser, page_settings, served, tell_page
from phone_host.verbs.serve.program import Commands
from phone_host.verbs.serve.status import stderr_status
from phone_host.web.settings import PageSettings

_STEP_S: Final = 0.25


def run(options: argparse.Namespace) -> int:
    """Serve the page until stopped."""
    status = stderr_status()
    commands = Commands(
        options.config or usual_file(), options.keys, lambda line: say(f"phone-host: {line}", sys.stderr)
    )
    logs.set_up(commands.log_level)
    settings = page_settings(options.address, commands.keys.path, lan=options.lan)
    station = Station(commands)
    signals = StopSignals()
    with _opened_if_taken(settings, is_asked=options.open), served(station, settings) as server:
        url = first_url(server, settings)
        print(json_text({"url": url}) if options.json else f"phone-host: the page: {url}", flush=True)
        tell_page(server, settings)
        if options.open:
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
