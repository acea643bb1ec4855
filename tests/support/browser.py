"""A headless Chromium that shows one page: its text, its errors, its pictures, a mouse and fingers.

It is driven through the DevTools protocol over two pipes (`--remote-debugging-pipe`), so no port is opened and no further package is needed.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from common import now

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")

_PATIENCE_S = 60
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",  # WebGL without a graphics processor; left out, it works but complains
    "--hide-scrollbars",
    "--no-first-run",
    "--remote-debugging-pipe",
)

_ONTO_3_AND_4 = """
import fcntl, os, sys
high = [fcntl.fcntl(int(fd), fcntl.F_DUPFD, 10) for fd in sys.argv[1:3]]
os.dup2(high[0], 3)
os.dup2(high[1], 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""The browser reads its commands from descriptor 3 and writes its answers to 4."""


class Browser:
    """One page in a browser. `complaints` are what its console said: errors, and what its policy refused."""

    def __init__(self, to_fd: int, from_fd: int) -> None:
        self._to, self._from = to_fd, from_fd
        self._number, self._session, self._rest = 0, "", b""
        self.complaints: list[str] = []
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._call(f"{domain}.enable")

    def open(self, address: str, width_px: int = 1000, height_px: int = 800, *, dark: bool = False) -> None:
        """Load a page and wait until it is complete."""
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._call("Emulation.setEmulatedMedia", features=scheme)
        self._call(
            "Emulation.setDeviceMetricsOverride",
            width=width_px,
            height=height_px,
            deviceScaleFactor=1,
            mobile=width_px < 600,
        )
        self._call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def ask(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript on the page."""
        answer = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str) -> None:
        """Wait until an expression is true."""
        until_ns = now.monotonic_ns() + _PATIENCE_S * 1_000_000_000
        while not self.ask(expression):
            assert now.monotonic_ns() < until_ns, expression
            self.ask("new Promise(done => setTimeout(done, 20))")

    def move(self, x: float, y: float, *, kind: str = "mouseMoved", held: bool = False) -> None:
        """Move, press or release the mouse at a place of the window."""
        button = "left" if held or kind != "mouseMoved" else "none"
        self._call(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=int(held), clickCount=int(held)
        )

    def touch(self, kind: str, *places: tuple[float, float]) -> None:
        """Put fingers on the window, move them, or lift them."""
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
        self._call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def picture(self, path: Path) -> None:
        """Write what the whole page looks like, also below the window's edge, as PNG."""
        size = self._call("Page.getLayoutMetrics")["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        data = self._call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)["data"]
        path.write_bytes(base64.b64decode(data))

    def _call(self, method: str, **values: Any) -> Any:
        self._number += 1
        message = {"id": self._number, "method": method, "params": values}
        if self._session:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._to, data) :]
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            # What the software renderer says of its own speed is no complaint of the page's.
            if "GL Driver Message" in json.dumps(answer):
                continue
            if answer.get("method") in {"Runtime.exceptionThrown", "Log.entryAdded"}:
                self.complaints.append(json.dumps(answer["params"]))

    def _read(self) -> Any:
        while b"\0" not in self._rest:
            assert select.select([self._from], [], [], _PATIENCE_S)[0], "the browser does not answer"
            data = os.read(self._from, 1 << 20)
            assert data, "the browser has ended"
            self._rest += data
        text, _, self._rest = self._rest.partition(b"\0")
        return json.loads(text)


@contextmanager
def browser(profile: Path) -> Iterator[Browser]:
    """Start a browser with its own profile; it ends with the block."""
    assert CHROMIUM is not None
    to_read, to_write = os.pipe()
    from_read, from_write = os.pipe()
    profile.mkdir(parents=True, exist_ok=True)
    log = (profile / "stderr.txt").open("wb")
    command = [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}"]
    start = [sys.executable, "-c", _ONTO_3_AND_4, str(to_read), str(from_write), *command]
    process = subprocess.Popen(start, pass_fds=(to_read, from_write), stdout=subprocess.DEVNULL, stderr=log)
    os.close(to_read)
    os.close(from_write)
    try:
        yield Browser(to_write, from_read)
    finally:
        process.terminate()
        process.wait(_PATIENCE_S)
        log.close()
        os.close(to_write)
        os.close(from_read)
