"""Takes the pictures in docs/images, from rendered scenes: `python -m tests.web.pictures [live] [scan] [reports]`."""

import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import sync_playwright

from common import now
from common.ledger import StageTimes
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.model import Processed, RectifiedPair
from phone_host.output.axes import Axes
from phone_host.report.scan_report import scan_verdict
from phone_host.run.scan_job import finished_scan
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.patches import Patches
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scene.object_scene import Setting, object_scene
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Activity, ScanState, StepName
from tests.support.boards import BOARD, poses, render_pair
from tests.support.rigs import small_rig, unlike_rig
from tests.web.conftest import CHROMIUM, LAPTOP, PHONE
from tests.web.played import BOARDS, CAMERAS, Played, guide_snapshot, playing, rendered

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"
QUALITY = 82
PATIENCE_MS = 180_000
"""Rendering keeps the machine busy."""
SETTINGS = {"link": BOARDS[1].uri, "camera": CAMERAS[0].uri, "calibration": "rig.yaml"}


def keep(page: Any, name: str) -> None:
    """Save what the page shows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.png"
        page.screenshot(path=path)
        image = cv2.imread(str(path))
    assert image is not None
    cv2.imwrite(str(FOLDER / f"{name}.webp"), image, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])


def show(page: Any, step: str) -> None:
    """Go to a step."""
    page.evaluate("step => { location.hash = step; }", step)
    page.wait_for_timeout(700)


def shown_board() -> tuple[Processed, GuideSnapshot]:
    """A rendered board before both cameras, and the guide that has found it."""
    turn = np.array([-0.3, 0.25, 0.0])
    middle = BOARD.points_m().mean(axis=0)
    pose = np.concatenate([turn, np.array([0.04, 0.0, 0.45]) - cv2.Rodrigues(turn)[0] @ middle])
    images = render_pair(small_rig(), pose)
    outlines = []
    for image in images:
        found, corners = cv2.findChessboardCornersSB(image, (BOARD.columns, BOARD.rows))
        assert found
        places = corners.reshape(BOARD.rows, BOARD.columns, 2) / image.shape[1::-1]
        outlines.append(tuple((float(x), float(y)) for x, y in places[[0, 0, -1, -1], [0, -1, -1, 0]]))
    return Processed(RectifiedPair(*images), None, None, StageTimes()), replace(
        guide_snapshot(), outlines=(outlines[0], outlines[1])
    )


def scanned(views: int) -> tuple[Patches, ScanState]:
    """A rendered thing, scanned on its mat from all around: its surface, and what the page says of it."""
    scene = object_scene("speckled", Setting(views=views))
    core = StereoCore(MatchSettings(disparities=256), Rectifier(scene.rig), wanted=DepthWanted(search_from_m=0.25))
    scan = scan_for(ScanWanted(mat=parse_mat(USUAL_MAT)))
    for number in range(views):
        view = scene.view(number)
        scan.take(str(number), float(number), core.compute(view.left, view.right, now.monotonic_ns))
    finished = finished_scan(scan, matcher="tandem", axes=Axes.MAT)
    assert scan.settings is not None
    patches, shown = Patches(1), finished.model.with_unseen(finished.report.unseen)
    patches.become(shown.mesh, scan.settings.voxel_m, shown.seen)
    verdict, words = scan_verdict(finished.report)
    files = ("model.ply", "trajectory.txt", "report.json", "index.html")
    folder = "/home/me/.local/share/tandemscan/scans/2026-11-29-104500"
    return patches, ScanState(
        words=words,
        level=verdict.value,
        pairs=views,
        fused=scan.fused,
        folder=folder,
        files=files,
        options={"mat": "usual"},
    )


def phone_host(*words: object) -> None:
    """Run a command; an exit code that is not 0 ends this program."""
    subprocess.run([Path(sys.executable).parent / "phone-host", *map(str, words)], check=True)


def take_reports(browser: Any) -> None:
    """Take the pictures of what commands write: the demo's page, and that of a calibration."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        phone_host("demo", "--out", folder / "demo")
        sides = folder / "left", folder / "right"
        for side in sides:
            side.mkdir()
        for number, pose in enumerate(poses(16, seed=3)):
            for side, image in zip(sides, render_pair(unlike_rig(), pose), strict=True):
                cv2.imwrite(str(side / f"{number:02}.png"), image)
        phone_host("calibrate", *sides, "--square", "25mm", "--out", folder / "rig" / "rig.yaml")
        for picture, path, title, width, height in (
            ("demo", "demo", "A pair, and its depth", 1000, 960),
            ("delays", "demo", "Where the time goes", 1040, 500),
            ("calibration", "rig", "What the views cover", 800, 1130),
        ):
            page = browser.new_page(viewport={"width": width, "height": height})
            page.set_default_timeout(PATIENCE_MS)
            page.goto((folder / path / "index.html").as_uri())
            page.get_by_role("heading", name=title).evaluate(
                "heading => scrollTo(0, heading.closest('section').getBoundingClientRect().top - 12)"
            )
            page.wait_for_timeout(1000)
            keep(page, picture)
            page.close()


def take_live(browser: Any) -> None:
    """Take the pictures of the live page."""
    board, guide = shown_board()
    program = Played((board,))
    server = PageServer(program, PageSettings(port=0))
    server.start()
    laptop = browser.new_page(viewport=LAPTOP)
    phone = browser.new_page(viewport=PHONE, color_scheme="dark", device_scale_factor=1.5, has_touch=True)
    for page in (laptop, phone):
        page.set_default_timeout(PATIENCE_MS)
        page.goto(server.url)
    program.change(
        activity=Activity.CALIBRATING,
        guide=guide,
        begun=1,
        settings=dict(list(SETTINGS.items())[:2]),
        done={StepName.BOARD, StepName.CAMERA, StepName.CHECK},
    )
    show(laptop, "calibration")
    program.emit()
    laptop.wait_for_timeout(900)
    keep(laptop, "page-calibration")
    program.change(
        activity=Activity.RUNNING, guide=None, done=set(StepName) - {StepName.SCAN}, settings=SETTINGS, begun=2
    )
    program.pairs = rendered(8)
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
        keep(laptop, "page-run")
        laptop.locator(".charts").scroll_into_view_if_needed()
        laptop.wait_for_timeout(1500)
        plot = laptop.locator("#chart-delays .u-over").bounding_box()
        laptop.mouse.move(plot["x"] + 0.6 * plot["width"], plot["y"] + 0.5 * plot["height"])
        laptop.wait_for_timeout(700)
        keep(laptop, "page-charts")
        keep(phone, "page-phone-depth")
        phone.check("input[value=cloud]", force=True)
        phone.wait_for_timeout(2500)
        keep(phone, "page-phone-cloud")
    server.stop()


def take_scan(browser: Any) -> None:
    """Take the picture of a scan that is over, on the live page."""
    program = Played(rendered(1), settings=SETTINGS, done=set(StepName), axes="mat")
    program.patches, program.scan = scanned(24)
    program.emit()
    server = PageServer(program, PageSettings(port=0))
    server.start()
    page = browser.new_page(viewport={**LAPTOP, "height": 1150})
    page.set_default_timeout(PATIENCE_MS)
    page.goto(server.url)
    show(page, "scan")
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    page.wait_for_timeout(2500)
    keep(page, "page-scan")
    server.stop()


def main() -> None:
    """Take them all, or those that are asked for."""
    takes = {"live": take_live, "scan": take_scan, "reports": take_reports}
    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--enable-unsafe-swiftshader", "--hide-scrollbars"]
        )
        for name in sys.argv[1:] or takes:
            takes[name](browser)
        browser.close()


if __name__ == "__main__":
    main()
