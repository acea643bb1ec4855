"""Starts the page's server, for `serve`, beside a run, and for a browser's camera; and tells where it is."""

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
from common.program.invocation import command_line
from common.program.settings import Resolved
from common.program.terminal import say
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.uris import is_browser, without_password
from phone_host.declared_settings import PhoneHostSettings
from phone_host.jobs.run_request import RunRequest
from phone_host.output.axes import Axes
from phone_host.serve.beside import BesideRun
from phone_host.serve.choices import choices_of, shown_words, value_schemas
from phone_host.serve.saved import page_folder
from phone_host.settings import key_folder
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
    settings = PageSettings(host=host, port=port, credentials=credentials, values=value_schemas())
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
    print(invitation(urls, settings.credentials), file=sys.stderr)  # noqa: T201 - a code made of characters, never fitted to a width
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


@contextmanager
def camera_page(uri: str, keys: Path) -> Iterator[BrowserFeed | None]:
    """Serve the page while the block lasts, if a browser's camera is meant: it has no other way to give it.

    Args:
        uri: of the camera.
        keys: folder of the secrets.

    Raises:
        UnavailableError: the port is taken, or a package is missing.
    """
    if not is_browser(uri):
        yield None
        return
    page = BesideRun(
        {"camera": uri},
        lambda _: "",
        snapshots=page_folder(None, "snapshots"),
        recordings=page_folder(None, "recordings"),
        axes=Axes.CAMERA,
    )
    settings = page_settings(None, keys)
    with served(page, settings) as server:
        _tell(server, settings, uri)
        yield page.feed


def _tell(server: PageServer, settings: PageSettings, camera: str) -> None:
    say(f"phone-host: the page: {first_url(server, settings)}", sys.stderr, flush=True)
    tell_page(server, settings)
    if is_browser(camera):
        say("phone-host: open it in the browser whose camera is meant, and start that camera", sys.stderr, flush=True)


@contextmanager
def page_beside(request: RunRequest, found: Resolved[PhoneHostSettings]) -> Iterator[BesideRun]:
    """Serve the page of a run while the block lasts; its address is told on stderr.

    Args:
        request: of the run, of which nothing is open yet.
        found: its settings.

    Raises:
        SettingsError: other machines reach the address that --serve names.
        UnavailableError: the port is taken, or a package is missing.
    """
    values = found.values
    choices = {**choices_of(request.given), "camera": without_password(values.camera)}
    beside = BesideRun(
        choices,
        lambda chosen: command_line("phone-host", "run", *shown_words(chosen)),
        snapshots=page_folder(request.out, "snapshots"),
        recordings=page_folder(request.out, "recordings"),
        axes=request.depth.axes,
    )
    address = request.serve if isinstance(request.serve, str) else None
    settings = page_settings(address, key_folder(values.keys).path, lan=request.lan)
    with served(beside, settings) as server:
        _tell(server, settings, values.camera)
        yield beside
