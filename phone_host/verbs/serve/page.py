"""Starts the page's server, for `serve` and for `run --serve`, and tells where it is."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.program.terminal import say
from phone_host.web.invitation import by_cable, invitation, own_names
from phone_host.web.secret_files import kept_credentials, kept_token
from phone_host.web.server import PageServer
from phone_host.web.settings import DEFAULT_HOST, DEFAULT_PORT, PageSettings
from phone_host.web.source import Source

_EVERYWHERE: Final = "0.0.0.0"  # noqa: S104 - with --lan only, which makes it https
_BROWSERS: Final = ("termux-open-url", "xdg-open", "open")


def address_of(text: str | None, default_host: str = DEFAULT_HOST) -> tuple[str, int]:
    """Read HOST:PORT; what is left out is as usual.

    Args:
        text: HOST:PORT, HOST, :PORT or PORT; None or empty: not given.
        default_host: the usual host.

    Raises:
        SettingsError: the port is none.
    """
    if not text:
        return default_host, DEFAULT_PORT
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]"):
        host, port = ("", text) if text.isdecimal() else (text, str(DEFAULT_PORT))
    if not (port.isascii() and port.isdecimal() and int(port) <= 65535):
        raise SettingsError(f"{text!r} is no address of a page", "give HOST:PORT, such as 127.0.0.1:8765")
    return host.strip("[]") or default_host, int(port)


def page_settings(text: str | None, keys: Path, *, lan: bool = False) -> PageSettings:
    """Return where the page is served: to this machine alone, or to other machines, by https.

    Args:
        text: HOST:PORT; None: not given.
        keys: folder of the secrets.
        lan: whether other machines may come.

    Raises:
        SettingsError: other machines reach that address, and may not come.
    """
    host, port = address_of(text, _EVERYWHERE if lan else DEFAULT_HOST)
    credentials = kept_credentials(keys, own_names(), datetime.now().astimezone()) if lan else None
    settings = PageSettings(host=host, port=port, credentials=credentials)
    return replace(settings, token=kept_token(keys))


@contextmanager
def served(source: Source, settings: PageSettings) -> Iterator[PageServer]:
    """Serve the page while the block runs.

    Args:
        source: the program behind it.
        settings: where, and for whom.

    Raises:
        UnavailableError: the port is taken, or a package is missing.
    """
    server = PageServer(source, settings)
    server.start()
    try:
        yield server
    finally:
        server.stop()


def first_url(server: PageServer, settings: PageSettings) -> str:
    """Return the page's first address on this machine."""
    return server.url_at(DEFAULT_HOST) if settings.host == _EVERYWHERE else server.url


def tell_page(server: PageServer, settings: PageSettings) -> None:
    """Say on stderr how other machines open the page, if they may."""
    if settings.credentials is None:
        return
    names = own_names() if settings.host == _EVERYWHERE else (settings.host,)
    urls = [server.url_at(name) for name in names] or [server.url]
    print(invitation(urls, settings.credentials), file=sys.stderr)
    say(by_cable(server.port), sys.stderr, flush=True)


def open_browser(url: str) -> None:
    """Open the browser; what goes wrong is one line."""
    program = next((name for name in _BROWSERS if shutil.which(name)), None)
    if program is None:
        problem = "no program to open a browser with is installed"
    else:
        try:
            quiet = subprocess.DEVNULL
            subprocess.Popen([program, url], stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
        except OSError as error:
            problem = f"{program} cannot be started ({error.strerror})"
        else:
            return
    say(f"phone-host: {problem}: open the address by hand", sys.stderr, flush=True)
