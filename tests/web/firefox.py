"""A Firefox with a camera of its own making, driven by WebDriver BiDi (https://w3c.github.io/webdriver-bidi), which it speaks without help.

The driver has a thread of its own: while Playwright holds a Chromium for other tests, an event loop runs in theirs, and two loops in one thread
are refused.
"""

import asyncio
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import aiohttp

FIREFOX: Final = shutil.which("firefox-esr") or shutil.which("firefox")
_LISTENS: Final = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
_PREFERENCES: Final = {
    "media.navigator.permission.fake": True,  # its built-in camera needs permission as a real one does
    "media.autoplay.default": 0,
    "datareporting.policy.dataSubmissionEnabled": False,
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
}
_BUILT_IN: Final = """() => {
  const devices = navigator.mediaDevices;
  const asked = devices.getUserMedia.bind(devices);
  devices.getUserMedia = wanted => asked({ ...wanted, fake: true });
}"""
"""A camera that Firefox makes by itself, a colour that changes; it is had by this word alone."""

ALLOWED, DENIED = 1, 2
_ANSWER_S: Final = 60


class Firefox:
    """One page of a running Firefox.

    Args:
        url: where it listens for BiDi.
        loop: does the waiting, in another thread.
    """

    def __init__(self, url: str, loop: asyncio.AbstractEventLoop) -> None:
        self._loop, self._url, self._number = loop, url, 0
        self._context = ""

    def open(self) -> None:
        """Begin to drive it."""
        self._wait_for(self._connect())
        self._run("session.new", {"capabilities": {}})
        self._run("script.addPreloadScript", {"functionDeclaration": _BUILT_IN})
        tree = self._run("browsingContext.getTree", {})
        self._context = tree["contexts"][0]["context"]

    def close(self) -> None:
        """Drive it no more."""
        self._wait_for(self._session.close())

    def goto(self, url: str) -> None:
        """Open a page and wait until it is loaded."""
        self._run("browsingContext.navigate", {"context": self._context, "url": url, "wait": "complete"})

    def evaluate(self, script: str) -> Any:
        """Return a script's value: text, number or truth; a promise is waited for.

        Raises:
            RuntimeError: the script failed.
        """
        asked = {
            "expression": script,
            "target": {"context": self._context},
            "awaitPromise": True,
            "userActivation": True,
        }
        answer = self._run("script.evaluate", asked)
        if answer["type"] == "exception":
            raise RuntimeError(answer["exceptionDetails"]["text"])
        return answer["result"].get("value")

    def until(self, script: str) -> Any:
        """Wait until a script's value is true, and return it.

        Raises:
            TimeoutError: it does not become true; with what the page says.
        """
        end_s = time.monotonic() + _ANSWER_S
        while not (value := self.evaluate(script)):
            if time.monotonic() > end_s:
                raise TimeoutError(f"{script}; the page: {self.evaluate('document.body.innerText')}")
            time.sleep(0.05)
        return value

    @contextmanager
    def behind(self) -> Iterator[None]:
        """Put another tab before it while the block runs."""
        other = self._run("browsingContext.create", {"type": "tab", "background": False})["context"]
        yield
        self._run("browsingContext.close", {"context": other})
        self._run("browsingContext.activate", {"context": self._context})

    def picture(self) -> str:
        """Return what the page looks like: a PNG in base64."""
        return str(self._run("browsingContext.captureScreenshot", {"context": self._context})["data"])

    def _run(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = self._wait_for(self._ask(method, parameters))
        return answer

    def _wait_for(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _connect(self) -> None:
        self._session = aiohttp.ClientSession()
        self._socket = await self._session.ws_connect(f"{self._url}/session", max_msg_size=0)

    async def _ask(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self._number += 1
        await self._socket.send_json({"id": self._number, "method": method, "params": parameters})
        while True:
            answer = await self._socket.receive_json(timeout=_ANSWER_S)
            if answer.get("id") == self._number:
                if answer["type"] == "error":
                    raise RuntimeError(f"{method}: {answer['message']}")
                result: dict[str, Any] = answer["result"]
                return result


@contextmanager
def firefox(folder: Path, camera: int) -> Iterator[Firefox]:
    """Run one.

    Args:
        folder: for its profile.
        camera: whether pages may use it, ALLOWED or DENIED.

    Raises:
        TimeoutError: it does not listen, or does not answer.
        RuntimeError: it ended, or refused something. These and whatever else fails in the block carry what Firefox said.
    """
    wanted = _PREFERENCES | {"permissions.default.camera": camera}
    text = {value: str(value).lower() for value in wanted.values()}
    (folder / "user.js").write_text("".join(f'user_pref("{key}", {text[value]});\n' for key, value in wanted.items()))
    command = [str(FIREFOX), "--headless", "--no-remote", "--profile", str(folder), "--remote-debugging-port", "0"]
    said = folder / "said.txt"  # no pipe: a Firefox that fills one stands still
    with said.open("w") as out, subprocess.Popen(command, stdout=out, stderr=out) as process, _own_loop() as loop:
        try:
            page = Firefox(_listens_at(process, said), loop)
            try:
                page.open()
                yield page
            finally:
                page.close()
        except BaseException as error:  # a test's time limit, too
            error.add_note(f"Firefox said:\n{said.read_text(errors='replace')}")
            raise
        finally:
            process.terminate()


def _listens_at(process: "subprocess.Popen[bytes]", said: Path) -> str:
    end_s = time.monotonic() + _ANSWER_S
    while (found := _LISTENS.search(said.read_text(errors="replace"))) is None:
        if process.poll() is not None:
            raise RuntimeError(f"Firefox ended with {process.returncode}")
        if time.monotonic() > end_s:
            raise TimeoutError("Firefox does not listen")
        time.sleep(0.05)
    return found[1]


@contextmanager
def _own_loop() -> Iterator[asyncio.AbstractEventLoop]:
    """Run an event loop in a thread."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, name="firefox", daemon=True)
    thread.start()
    try:
        yield loop
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
