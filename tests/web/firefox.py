"""A Firefox with a camera of its own making, driven by WebDriver BiDi (https://w3c.github.io/webdriver-bidi), which it speaks without help."""

import asyncio
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
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
        loop: does the waiting.
    """

    def __init__(self, url: str, loop: asyncio.AbstractEventLoop) -> None:
        self._loop, self._url, self._number = loop, url, 0
        self._context = ""

    async def open(self) -> None:
        """Begin to drive it."""
        self._session = aiohttp.ClientSession()
        self._socket = await self._session.ws_connect(f"{self._url}/session", max_msg_size=0)
        await self._ask("session.new", {"capabilities": {}})
        await self._ask("script.addPreloadScript", {"functionDeclaration": _BUILT_IN})
        tree = await self._ask("browsingContext.getTree", {})
        self._context = tree["contexts"][0]["context"]

    async def close(self) -> None:
        """Drive it no more."""
        await self._session.close()

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

    def picture(self) -> str:
        """Return what the page looks like: a PNG in base64."""
        return str(self._run("browsingContext.captureScreenshot", {"context": self._context})["data"])

    def _run(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        return self._loop.run_until_complete(self._ask(method, parameters))

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
    """
    wanted = _PREFERENCES | {"permissions.default.camera": camera}
    text = {value: str(value).lower() for value in wanted.values()}
    (folder / "user.js").write_text("".join(f'user_pref("{key}", {text[value]});\n' for key, value in wanted.items()))
    command = [str(FIREFOX), "--headless", "--no-remote", "--profile", str(folder), "--remote-debugging-port", "0"]
    loop = asyncio.new_event_loop()
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stderr is not None
            found = next(match for line in process.stderr if (match := _LISTENS.search(line)))
            page = Firefox(found[1], loop)
            loop.run_until_complete(page.open())
            try:
                yield page
            finally:
                loop.run_until_complete(page.close())
        finally:
            process.terminate()
            process.communicate()
            loop.close()
