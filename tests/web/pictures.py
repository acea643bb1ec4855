"""Takes the pictures of docs/page.md, from rendered scenes: `python -m tests.web.pictures`."""

import tempfile
from pathlib import Path
from typing import Any

import cv2
from playwright.sync_api import sync_playwright

from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Activity, StepName
from tests.web.conftest import CHROMIUM, LAPTOP, PHONE
from tests.web.played import BOARDS, CAMERAS, Played, guide_snapshot, playing, rendered

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"
QUALITY = 82
SETTINGS = {"link": BOARDS[1].uri, "camera": CAMERAS[0].uri, "calibration": "rig.yaml"}


def keep(page: Any, name: str) -> None:
    """Save what the page shows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.png"
        page.screenshot(path=path)
        image = cv2.imread(str(path))
    assert image is not None
    cv2.imwrite(str(FOLDER / f"page-{name}.webp"), image, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])


def show(page: Any, step: str) -> None:
    """Go to a step."""
    page.evaluate("step => { location.hash = step; }", step)
    page.wait_for_timeout(700)


def main() -> None:
    """Take them all."""
    program = Played(rendered(8))
    server = PageServer(program, PageSettings(port=0))
    server.start()
    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--enable-unsafe-swiftshader", "--hide-scrollbars"]
        )
        laptop = browser.new_page(viewport=LAPTOP)
        phone = browser.new_page(viewport=PHONE, color_scheme="dark", device_scale_factor=1.5, has_touch=True)
        for page in (laptop, phone):
            page.goto(server.url)
        show(phone, "board")
        keep(phone, "board")
        program.change(
            activity=Activity.CALIBRATING,
            guide=guide_snapshot(),
            settings=dict(list(SETTINGS.items())[:2]),
            done={StepName.BOARD, StepName.CAMERA, StepName.CHECK},
        )
        show(laptop, "calibration")
        keep(laptop, "calibration")
        program.change(activity=Activity.RUNNING, guide=None, done=set(StepName), settings=SETTINGS)
        with playing(program, 6):
            for page in (laptop, phone):
                show(page, "run")
                page.wait_for_selector("#views[data-pair]")
            laptop.wait_for_timeout(6000)
            box = laptop.locator("#map-frame").bounding_box()
            for x, y in ((0.6, 0.2), (0.5, 0.92)):
                laptop.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
            laptop.wait_for_selector("#readout[data-from=program]")
            laptop.wait_for_timeout(600)
            keep(laptop, "run")
            laptop.locator(".charts").scroll_into_view_if_needed()
            laptop.wait_for_timeout(1500)
            plot = laptop.locator("#chart-delays .u-over").bounding_box()
            laptop.mouse.move(plot["x"] + 0.6 * plot["width"], plot["y"] + 0.5 * plot["height"])
            laptop.wait_for_timeout(700)
            keep(laptop, "charts")
            keep(phone, "phone-depth")
            phone.check("input[value=cloud]", force=True)
            phone.wait_for_timeout(2500)
            keep(phone, "phone-cloud")
        browser.close()
    server.stop()


if __name__ == "__main__":
    main()
