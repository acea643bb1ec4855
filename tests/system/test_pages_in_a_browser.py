"""Pages in a real browser: the script runs under its policy, a pointer reads metres, the cloud turns, nothing is wider than a phone."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.model import Epipolar
from phone_host.report.calibration_page import calibration_page
from phone_host.report.chart_view import stacked_chart
from phone_host.report.model_view import ShownModel, model_view
from phone_host.report.page_frame import document
from phone_host.report.page_links import NextCommand
from phone_host.report.page_script import Script
from phone_host.report.stereo_page import stereo_page
from phone_host.scan.mesh import Mesh
from phone_host.svg.plots import Quantity
from tests.support import calibration_series
from tests.support.browser import Browser, browser, needs_chromium
from tests.support.stereo_pages import page_data, processed

pytestmark = needs_chromium

DRAWN = "document.querySelector('.turn canvas').dataset.drawn.split(' ').map(Number)"


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Browser, str]]:
    """A browser, and the address of a page of a wall at 2 m with a box at 1 m before it."""
    folder = tmp_path_factory.mktemp("page")
    page = folder / "index.html"
    page.write_text(stereo_page(page_data(commands=(NextCommand("Again:", "phone-host stereo a b"),))))
    with browser(folder / "profile") as running:
        yield running, page.as_uri()


def test_a_pointer_reads_metres_and_where_there_are_none(shown: tuple[Browser, str]) -> None:
    """Over the box the page says 1 m with its uncertainty, over the wall 2 m, elsewhere why there is none; the match is 40 px further left."""
    page, address = shown
    page.open(address)
    page.wait("document.documentElement.dataset.ready === 'yes'")
    left, top, width, height = box(page, "[data-side=left]")

    def read(x: float, y: float) -> str:
        page.move(left + width * (x + 0.5) / 160, top + height * (y + 0.5) / 120)
        return str(page.ask("document.querySelector('.readout').textContent"))

    # 1^2 / 40 * 0.5 = 0.0125 m; 2^2 / 40 * 0.5 = 0.05 m; X = 0.5 px * 1 m / 400 px
    assert read(80, 60) == "1.000 m ± 0.013 m, x 80, y 60 px (X 0.001 m, Y 0.001 m)"
    assert page.ask("document.querySelector('[data-side=right] i').style.left") == f"{40.5 / 160 * 100:g}%"
    assert read(100, 100).startswith("2.00 m ± 0.05 m, x 100, y 100 px")
    assert read(5, 60) == "no depth here, x 5, y 60 px"
    assert read(100, 5) == "cut: outside the depth limits, x 100, y 5 px"
    assert page.complaints == []


@pytest.mark.parametrize(("epipolar", "row"), [(Epipolar.UP, 20), (Epipolar.DOWN, 100)])
def test_the_match_of_stacked_cameras_is_in_the_same_column(
    shown: tuple[Browser, str], tmp_path: Path, epipolar: Epipolar, row: int
) -> None:
    """A point of the box, 40 px of disparity, lies 40 px higher in the image of a camera below, and 40 px lower in that of one above."""
    made = processed()
    path = tmp_path / "index.html"
    path.write_text(stereo_page(page_data(processed=replace(made, pair=replace(made.pair, epipolar=epipolar)))))
    page, _ = shown
    page.open(path.as_uri())
    page.wait("document.documentElement.dataset.ready === 'yes'")
    left, top, width, height = box(page, "[data-side=left]")
    page.move(left + width * 80.5 / 160, top + height * 60.5 / 120)
    style = "document.querySelector('[data-side=right] i').style"
    assert page.ask(f"parseFloat({style}.left)") == pytest.approx(80.5 / 160 * 100, abs=1e-3)
    assert page.ask(f"parseFloat({style}.top)") == pytest.approx((row + 0.5) / 120 * 100, abs=1e-3)


def test_mouse_and_fingers_turn_and_zoom_the_cloud(shown: tuple[Browser, str], tmp_path: Path) -> None:
    """A drag turns the cloud by the way of the mouse, two fingers that part to twice their distance halve the distance; points are drawn."""
    page, address = shown
    page.open(address)
    page.wait("document.querySelector('.turn canvas').dataset.drawn")
    page.ask("document.querySelector('.turn canvas').scrollIntoView()")
    left, top, width, height = box(page, ".turn canvas")
    x, y = left + width / 2, top + height / 2
    azimuth, polar, away = drawn(page)
    page.move(x, y, kind="mousePressed", held=True)
    page.move(x + 50, y + 10, held=True)
    page.move(x + 50, y + 10, kind="mouseReleased")
    # OrbitControls: the canvas's height is one turn at speed 1, ours is 0.7.
    turned = 2 * math.pi * 0.7 / height
    page.wait(
        f"Math.abs({DRAWN}[0] - {azimuth - 50 * turned}) < 0.03 && Math.abs({DRAWN}[1] - {polar - 10 * turned}) < 0.03"
    )
    page.touch("touchStart", (x - 40, y), (x + 40, y))
    page.touch("touchMove", (x - 80, y), (x + 80, y))
    page.touch("touchEnd")
    page.wait(f"Math.abs({DRAWN}[2] - {away / 2}) < 0.01")
    page.ask("[...document.querySelectorAll('[data-to]')].find(one => one.dataset.to === 'front').click()")
    page.wait(f"Math.abs({DRAWN}[2] - {away / 2}) > 0.1")
    page.picture(tmp_path / "seen.png")
    seen = cv2.imread(str(tmp_path / "seen.png"))
    assert seen is not None
    row = round(y + page.ask("scrollY"))
    middle = seen[row - 60 : row + 60, round(x) - 60 : round(x) + 60]
    assert middle.std() > 40  # the texture of the box; the empty ground is even
    assert page.complaints == []


@pytest.mark.parametrize("width_px", [390, 1400])
def test_the_page_fits_the_window(shown: tuple[Browser, str], width_px: int) -> None:
    """On a phone and on a desktop, in the dark, too, no part of the page is wider than the window; the copy button is there."""
    page, address = shown
    page.open(address, width_px, dark=True)
    page.wait("document.documentElement.dataset.ready === 'yes'")
    assert page.ask("document.documentElement.scrollWidth") <= width_px
    assert page.ask("document.querySelector('button.copy').hidden") is False
    assert page.ask("getComputedStyle(document.body).backgroundColor") == "rgb(16, 19, 24)"


@pytest.mark.parametrize(("width_px", "dark"), [(360, True), (1400, False)])
def test_the_page_of_a_calibration_fits_the_window(
    shown: tuple[Browser, str], tmp_path: Path, width_px: int, *, dark: bool
) -> None:
    """On a phone and on a desktop no part is wider than the window, every picture is shown, and its policy refuses nothing."""
    page, _ = shown
    path = tmp_path / "index.html"
    path.write_text(calibration_page(calibration_series.series()))
    page.complaints.clear()
    page.open(path.as_uri(), width_px, dark=dark)
    assert page.ask("document.documentElement.scrollWidth") <= width_px
    assert page.ask("[...document.querySelectorAll('svg.plot image')].length") > 10
    assert page.complaints == []


@pytest.mark.parametrize(("width_px", "dark"), [(390, True), (1280, False)])
def test_charts_are_read_zoomed_and_hidden_by_keys(
    shown: tuple[Browser, str], tmp_path: Path, width_px: int, *, dark: bool
) -> None:
    """Keys go to a pair and read its delays, zoom to the pairs around it and back; a hidden layer no longer counts; a pointer reads; nothing is refused."""
    page, _ = shown
    path = tmp_path / "index.html"
    time_s = np.arange(101.0)
    layers = [
        Quantity(label="low", values_ns=np.full(101, 10e6), colour=0),
        Quantity(label="high", values_ns=1e6 * (30 + time_s), colour=5),
    ]
    path.write_text(document("charts", stacked_chart("delays", time_s, layers), Script.CHARTS))
    page.complaints.clear()
    page.open(path.as_uri(), width_px, dark=dark)
    page.wait("document.querySelector('.u-over') !== null")
    assert page.ask("document.documentElement.scrollWidth") <= width_px
    assert "JavaScript" not in page.ask("document.body.innerText")

    def press(key: str, where: str = "[data-chart]") -> list[str]:
        event = f"new KeyboardEvent('keydown', {{key: '{key}', bubbles: true, cancelable: true}})"
        page.ask(f"document.querySelector('{where}').dispatchEvent({event})")
        page.ask("new Promise(done => setTimeout(done, 60))")
        return list(page.ask("[...document.querySelectorAll('.u-value')].map(one => one.textContent)"))

    assert press("End") == ["100.0 s", "130.0 ms", "10.0 ms"]
    assert press("ArrowLeft") == ["99.0 s", "129.0 ms", "10.0 ms"]
    assert press("Home") == ["0.0 s", "30.0 ms", "10.0 ms"]
    highest = page.ask(_INK)
    press("Enter", ".u-series:nth-child(3) .u-label")
    assert page.ask("document.querySelectorAll('.u-legend .u-off').length") == 1
    assert page.ask(_INK) != highest
    press("Enter", ".u-series:nth-child(3) .u-label")
    assert page.ask(_INK) == highest
    left, top, width, height = box(page, ".u-over")
    page.move(left + width / 2, top + height / 2)
    page.wait("document.querySelector('.u-value').textContent === '50.0 s'")
    press("+")
    page.move(left + 2, top + height / 2)
    page.wait("document.querySelector('.u-value').textContent === '25.0 s'")
    press("Escape")
    page.move(left + 1, top + height / 2)
    page.wait("document.querySelector('.u-value').textContent === '0.0 s'")
    assert page.complaints == []


_INK = "document.querySelector('.uplot canvas').toDataURL()"


def box(page: Browser, selector: str) -> list[float]:
    """Return left, top, width and height of the first such element in the window."""
    found = page.ask(
        f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; }})()"
    )
    return [float(value) for value in found]


def drawn(page: Browser) -> list[float]:
    """Return azimuth, polar angle and distance at which the cloud was last drawn."""
    return [float(value) for value in page.ask(DRAWN)]


def test_unseen_surface_of_a_scan_is_hatched(shown: tuple[Browser, str], tmp_path: Path) -> None:
    """Of a red square the right half was never in view: dark or bright lines cross it there, and none on the left; the caption says what they mean."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 41), np.linspace(-0.5, 0.5, 41))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 2.0)]).astype(np.float32)
    corner = np.arange(41 * 41).reshape(41, 41)[:-1, :-1].ravel()
    quads = np.column_stack([corner, corner + 41, corner + 1, corner + 1, corner + 41, corner + 42]).reshape(-1, 3)
    mesh = Mesh(points, np.tile(np.array([[200, 20, 20]], np.uint8), (len(points), 1)), quads.astype(np.int32))
    model = ShownModel(mesh, np.full(len(points), 0.001, np.float32), 0.01, seen=points[:, 0] < 0)
    path = tmp_path / "index.html"
    path.write_text(document("Scan", model_view(model, "model.ply"), Script.DEPTH))
    page, _ = shown
    page.complaints.clear()
    page.open(path.as_uri())
    page.wait("document.querySelector('.turn canvas').dataset.drawn")
    page.ask("document.querySelector('button[data-to=front]').click()")
    page.wait(f"Math.abs({DRAWN}[1] - Math.PI / 2) < 0.02")
    page.wait("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    left, top, width, height = box(page, ".turn canvas")
    page.picture(tmp_path / "seen.png")
    picture = cv2.imread(str(tmp_path / "seen.png"))
    assert picture is not None
    row, middle = round(top + page.ask("scrollY") + height / 2), round(left + width / 2)
    spread = [
        picture[row - 9 : row + 9, middle + step - 12 : middle + step + 12, 1].astype(float).std() for step in (-40, 40)
    ]
    assert spread[0] < 3
    assert spread[1] > 15
    assert "Hatched surface was never in view" in page.ask("document.querySelector('figcaption').textContent")
    assert page.complaints == []


def test_a_scan_turns_and_shows_how_exactly_it_is_known(shown: tuple[Browser, str], tmp_path: Path) -> None:
    """The model is drawn in its colours, red; `shape alone` is grey; a button turns it; its policy refuses nothing."""
    points = np.array([[-0.5, -0.5, 2], [0.5, -0.5, 2], [-0.5, 0.5, 2], [0.5, 0.5, 2]], np.float32)
    mesh = Mesh(
        points, np.tile(np.array([[200, 20, 20]], np.uint8), (4, 1)), np.array([[0, 2, 1], [1, 2, 3]], np.int32)
    )
    path = tmp_path / "index.html"
    view = model_view(ShownModel(mesh, np.array([0.001, 0.002, 0.003, 0.004], np.float32), 0.01), "model.ply")
    path.write_text(document("Scan", view, Script.DEPTH))
    page, _ = shown
    page.complaints.clear()
    page.open(path.as_uri())
    page.wait("document.querySelector('.turn canvas').dataset.drawn")
    page.ask("document.querySelector('button[data-to=front]').click()")
    left, top, width, height = box(page, ".turn canvas")

    def middle() -> list[float]:
        page.picture(tmp_path / "seen.png")
        seen = cv2.imread(str(tmp_path / "seen.png"))
        assert seen is not None
        row, column = round(top + page.ask("scrollY") + height / 2), round(left + width / 2)
        blue, green, red = seen[row - 9 : row + 9, column - 9 : column + 9].reshape(-1, 3).mean(axis=0).tolist()
        return [red, green, blue]

    page.wait(f"Math.abs({DRAWN}[1] - Math.PI / 2) < 0.02")
    red, green, blue = middle()
    assert red > 150
    assert max(green, blue) < 60
    page.ask("document.querySelector('[data-paint=shape]').click()")
    page.wait("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    shape = middle()
    assert min(shape) > 100
    assert max(shape) - min(shape) < 5
    before = drawn(page)
    page.ask("document.querySelector('button[data-to=side]').click()")
    page.wait(f"Math.abs({DRAWN}[0] - {before[0]}) > 0.5")
    assert page.complaints == []
