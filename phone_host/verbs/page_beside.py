"""The page beside a run: `run --serve`."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from common.program.invocation import command_line
from common.program.settings import Resolved
from common.program.terminal import say
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.browser_uri import is_browser
from phone_host.camera.http_uri import without_password
from phone_host.declared_settings import PhoneHostSettings
from phone_host.jobs.run_request import RunRequest
from phone_host.output.axes import Axes
from phone_host.serve.beside import BesideRun
from phone_host.settings import key_folder
from phone_host.verbs.serve.choices import choices_of, shown_words
from phone_host.verbs.serve.page import first_url, page_settings, served, tell_page
from phone_host.verbs.serve.places import page_folder
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings


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
