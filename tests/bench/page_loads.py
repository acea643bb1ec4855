"""How soon the page shows depth, and what is transferred for it: a real browser opens it afresh several times."""

import shutil
import time
from dataclasses import dataclass

_LOADS = 7
_PATIENCE_MS = 60_000

_NOTE_WHEN = """
document.addEventListener('DOMContentLoaded', () => {
  const note = (id, name) => {
    const element = document.getElementById(id);
    const watch = new MutationObserver(() => {
      if (!element.dataset[name]) return;
      watch.disconnect();
      requestAnimationFrame(() => setTimeout(() => { window[id + 'ShownAt'] = performance.timeOrigin + performance.now(); }));
    });
    watch.observe(element, { attributes: true });
  };
  note('views', 'pair');
  note('cloud', 'drawn');
});
"""
"""Notes in the page when something stands on the screen, ms since 1970: asked from outside, a page that draws its first
cloud without a GPU answers a second later."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """The page, opened once by a browser that knows nothing of it.

    Attributes:
        depth_s: from the request until the first depth stands on the screen, s.
        cloud_s: until the first cloud does, s.
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
            page.add_init_script(_NOTE_WHEN)
            began_ms = time.time_ns() / 1e6
            page.goto(f"{url}#run", wait_until="commit")
            depth_ms, cloud_ms = (
                page.wait_for_function(f"() => window.{name}ShownAt").json_value() - began_ms
                for name in ("views", "cloud")
            )
            taken.append(Load(depth_s=depth_ms / 1e3, cloud_s=cloud_ms / 1e3, kilobytes=sum(sizes) / 1e3))
            context.close()
        browser.close()
    return tuple(taken)
