"""The page beside a run: `run --serve`."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from common.program.invocation import command_line
from common.program.terminal import say
from phone_host.camera.http_uri import without_password
from phone_host.output.axes import Axes
from phone_host.serve.beside import BesideRun
from phone_host.verbs.run.prepared import Opened
from phone_host.verbs.serve.choices import choices_of, run_words
from phone_host.verbs.serve.page import own_settings, served
from phone_host.verbs.serve.places import snapshot_folder


@contextmanager
def page_beside(opened: Opened) -> Iterator[BesideRun]:
    """Serve the page of a run while the block lasts; its address is told on stderr.

    Args:
        opened: the run, which has not begun.

    Raises:
        SettingsError: other machines reach the address that --serve names.
        UnavailableError: the port is taken, or a package is missing.
    """
    options = opened.options
    values = opened.found.values
    choices = {**choices_of(options), "link": " ".join(opened.named), "camera": without_password(values.camera)}
    beside = BesideRun(
        choices,
        command_line("phone-host", "run", *run_words(choices)),
        opened.core,
        snapshots=snapshot_folder(options.out),
        axes=Axes(options.axes),
    )
    with served(beside, own_settings(options.serve, opened.keys)) as server:
        say(f"phone-host: the page: {server.url}", sys.stderr, flush=True)
        yield beside
