"""A browser for all tests of this part; a server and a played program for each."""

import hashlib
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from tests.web.played import Played, rendered

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PHONE = {"width": 390, "height": 844}
LAPTOP = {"width": 1366, "height": 768}
TOKEN = "only-for-tests"
OTHER_NAME = "scanner.test"
FLAGS = (
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-fake-device-for-media-stream",  # a camera with focus and exposure; pages are asked for permission all the same
    f"--host-resolver-rules=MAP {OTHER_NAME} 127.0.0.1",
)
AXE = "axe-core@4.14.1"
AXE_SHA256 = "e6b0ce02b84d892e2e33e403485e7f3d6c29e2be6df65daf44d89ba564139745"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what needs a browser where there is none."""
    if CHROMIUM is None:
        for item in items:
            if "browser" in getattr(item, "fixturenames", ()):
                item.add_marker(pytest.mark.skip(reason="needs chromium"))


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Debian's Chromium. Playwright never downloads one."""
    os.environ["PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD"] = "1"
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  # only where there is a browser

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture(scope="session")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """axe-core's script, from npm: for tests only, the package never holds it."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("needs npm for axe-core")
    folder = tmp_path_factory.mktemp("axe")
    done = subprocess.run(
        [npm, "pack", "--silent", AXE], cwd=folder, capture_output=True, text=True, check=False, timeout=90
    )
    if done.returncode:
        pytest.skip(f"npm has no {AXE}: {done.stderr.strip().splitlines()[-1:]}")
    tarball = folder / done.stdout.strip()
    assert hashlib.sha256(tarball.read_bytes()).hexdigest() == AXE_SHA256
    subprocess.run(["tar", "xzf", tarball], cwd=folder, check=True)
    return (folder / "package" / "axe.min.js").read_text()


@pytest.fixture
def program() -> Played:
    """A program with three rendered pairs."""
    return Played(rendered(3))


@pytest.fixture
def server(program: Played) -> Iterator[PageServer]:
    """The real server before it."""
    serving = PageServer(program, PageSettings(port=0, token=TOKEN))
    serving.start()
    yield serving
    serving.stop()


class Complaints(list[str]):
    """What a page's console said, uncaught errors, and requests that left the server."""

    def watch(self, page: Any, address: str) -> None:
        """Collect from now on."""
        page.on("pageerror", lambda error: self.append(str(error)))
        page.on("console", lambda said: self.append(said.text) if said.type == "error" else None)
        page.on("request", lambda asked: None if _own(asked.url, address) else self.append(asked.url))


def _own(url: str, address: str) -> bool:
    host = address.split("//")[1].split("/", maxsplit=1)[0]
    return url.startswith(("blob:", "data:")) or url.split("//")[1].split("/", maxsplit=1)[0] == host


Opener = Callable[..., Any]


@pytest.fixture
def complaints() -> Complaints:
    """Stay empty, unless a test says otherwise."""
    return Complaints()


@pytest.fixture
def opened(browser: Any, server: PageServer, complaints: Complaints) -> Iterator[Opener]:
    """A function that opens the page as a person does, by its first URL, and then a step."""
    contexts = []

    def open_(step: str = "", size: dict[str, int] = LAPTOP, url: str = "", **options: Any) -> Any:
        context = browser.new_context(viewport=size, has_touch=size is PHONE, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(60_000)
        complaints.watch(page, server.url)
        page.goto(url or server.url)
        page.wait_for_selector("body[data-line=open]")
        if step:
            page.evaluate("step => { location.hash = step; }", step)
        return page

    yield open_
    for context in contexts:
        context.close()
