"""How soon the page shows depth, and what is transferred for it: a real browser opens it afresh several times."""

import shutil
import time
from dataclasses import dataclass

_LOADS = 7
_PATIENCE_MS = 60_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """The page, opened once by a browser that knows nothing of it.

    Attributes:
        depth_s: from the request to the first depth, s.
        cloud_s: to the first cloud, s.
        kilobytes: of everything that was requested up to then, as transferred, without the pairs on the WebSocket; kB.
    """

    depth_s: float
    cloud_s: float
    kilobytes: float


def loads(url: str) -> tuple[Load, ...]:
    """Open the page several times.

    Args:
        url: of the page of a run that shows depth.

    Returns:
        Each time; empty where there is no Chromium.
    """
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        return ()
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  # only where there is a browser

    taken = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        for _ in range(_LOADS):
            context = browser.new_context(viewport={"width": 1366, "height": 768})
            page = context.new_page()
            page.set_default_timeout(_PATIENCE_MS)
            session = context.new_cdp_session(page)
            session.send("Network.enable")
            sizes: list[float] = []
            session.on("Network.loadingFinished", lambda told, sizes=sizes: sizes.append(told["encodedDataLength"]))
            began = time.monotonic()
            page.goto(f"{url}#run", wait_until="commit")
            page.wait_for_selector("#views[data-pair]", state="attached")
            depth_s = time.monotonic() - began
            page.wait_for_selector("#cloud[data-drawn]", state="attached")
            taken.append(Load(depth_s=depth_s, cloud_s=time.monotonic() - began, kilobytes=sum(sizes) / 1e3))
            context.close()
        browser.close()
    return tuple(taken)
