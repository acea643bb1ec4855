"""The live page beside a run: what it shows is what was measured, and it stays so whatever comes and goes."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common import now
from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Activity, Answer, Command, Do
from tests.web.conftest import LAPTOP, PHONE, TOKEN, Complaints, Opener
from tests.web.played import Played, playing, rendered, true_depth

MOST_BYTES = 450_000


def until(page: Any, expression: str) -> None:
    """Wait until something is true. A function, because the page's policy forbids to evaluate text."""
    page.wait_for_function(f"() => {expression}")


def shows(page: Any, number: int) -> None:
    """Wait until the page shows a pair."""
    page.wait_for_selector(f"#views[data-pair='{number}']")


def tap(page: Any, x: float, y: float, frame: str = "#map-frame") -> None:
    """Press a pixel of the left image, 640 x 480."""
    page.locator(frame).scroll_into_view_if_needed()
    box = page.locator(frame).bounding_box()
    page.mouse.click(box["x"] + (x + 0.5) / 640 * box["width"], box["y"] + (y + 0.5) / 480 * box["height"])


def readout(page: Any, source: str) -> str:
    """Return what was measured, once it comes from `page` or `program`."""
    page.wait_for_selector(f"#readout[data-from={source}]")
    return str(page.text_content("#readout"))


def value_mm(words: str) -> float:
    """Return the number before the first mm."""
    found = re.search(r"([\d.]+) mm", words)
    assert found, words
    return float(found[1])


@pytest.fixture
def running(program: Played) -> Played:
    """The program in a run with one pair."""
    program.change(activity=Activity.RUNNING)
    program.emit()
    return program


def test_a_tap_shows_the_true_distance_and_two_taps_a_length(running: Played, opened: Opener) -> None:
    """The page's own value and the program's agree with the rendered truth to 1 %; a length is that between the two true places."""
    page = opened("run")
    shows(page, 0)
    truth, geometry = true_depth(3, 0), running.pairs[0].geometry
    assert geometry is not None
    places = []
    for x, y in ((480, 100), (320, 400)):
        z = truth.depth_m[y, x]
        assert truth.visible[y, x]
        place = np.array([(x - geometry.cx_px) / geometry.focal_px, (y - geometry.cy_px) / geometry.focal_px, 1]) * z
        places.append(place)
        page.keyboard.press("Escape")
        page.focus("#map-frame")
        page.keyboard.press("Escape")
        page.route("**/api/measure", lambda route: route.abort())
        tap(page, x, y)
        assert value_mm(readout(page, "page")) == pytest.approx(1000 * np.linalg.norm(place), rel=0.01)
        page.unroute("**/api/measure")
        page.keyboard.press("Escape")
        tap(page, x, y)
        words = readout(page, "program")
        assert words.startswith("distance ")
        assert "± 1" in words
        assert value_mm(words) == pytest.approx(1000 * np.linalg.norm(place), rel=0.01)
    page.keyboard.press("Escape")
    assert "Tap the picture" in page.text_content("#readout")
    tap(page, 480, 100)
    tap(page, 320, 400, "#left-frame")
    until(page, "document.querySelector('#readout').textContent.startsWith('length')")
    page.wait_for_selector("#readout[data-from=program]")
    truth_mm = 1000 * np.linalg.norm(places[0] - places[1])
    assert value_mm(page.text_content("#readout")) == pytest.approx(truth_mm, rel=0.01)
    assert page.locator("#map-frame .spot:visible").count() == 2


@pytest.mark.usefixtures("running")
def test_the_depth_picture_has_the_colours_of_the_true_depth(opened: Opener) -> None:
    """Where both cameras see a point, nearer is brighter: the picture's colours, read back, sort as the rendered truth does."""
    page = opened("run")
    shows(page, 0)
    rows, columns = (grid.ravel().tolist() for grid in np.mgrid[20:480:23, 40:640:31])
    shown = page.evaluate(
        """([rows, columns]) => { const c = document.querySelector('#map'), pen = c.getContext('2d'), by = 640 / c.width;
        return rows.map((row, k) => [...pen.getImageData(Math.round(columns[k] / by), Math.round(row / by), 1, 1).data].slice(0, 3)); }""",
        [rows, columns],
    )
    ramp = np.array(page.evaluate("import('/static/ramp.js').then(m => [...m.RAMP])")).reshape(256, 3)
    keys = {tuple(colour): level for level, colour in enumerate(ramp.tolist())}
    truth = true_depth(3, 0)
    found = [
        (keys[tuple(colour)], -np.log(truth.depth_m[row, column]))
        for row, column, colour in zip(rows, columns, shown, strict=True)
        if truth.visible[row, column] and any(colour)
    ]
    assert len(found) > 200
    assert np.corrcoef(np.array(found).T)[0, 1] > 0.99
    assert page.locator("#map-marks span:visible").count() >= 2


def test_a_run_without_depth_shows_nothing_of_the_run_before(
    running: Played, opened: Opener, complaints: Complaints
) -> None:
    """When a run begins, pictures, depth, cloud, figures and charts are cleared; a run without depth says so, and nothing fails."""
    page = opened("run")
    shows(page, 0)
    for number in (1, 2):
        assert running.emit() == number
        shows(page, number)
    page.locator("#chart-rate").scroll_into_view_if_needed()
    page.wait_for_selector("#chart-rate canvas")
    page.wait_for_selector("#cloud[data-drawn]")
    assert "93%" in page.text_content("#figures")
    inked = "id => { const c = document.getElementById(id); return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(v => v); }"
    assert all(page.evaluate(inked, name) for name in ("map", "left", "right", "cloud-over"))
    running.change(activity=Activity.IDLE)
    flat = [replace(each, disparity=None, cloud=None, geometry=None, limits=None) for each in running.pairs]
    running.pairs = tuple(flat)
    running.command(Command(do=Do.RUN))
    page.wait_for_selector("#views:not([data-pair])")
    assert page.text_content("#no-pair") == "No pair yet"
    assert not any(page.evaluate(inked, name) for name in ("map", "left", "right", "cloud-over"))
    assert page.locator("#cloud[data-drawn]").count() == 0
    assert page.locator("#chart-rate canvas").count() == 0
    number = running.emit()
    shows(page, number)
    assert "No depth in this run" in page.text_content("#no-pair")
    assert page.is_visible("#no-pair")
    assert "No depth in this run" in page.text_content("#cloud-wait")
    assert page.is_visible("#cloud-wait")
    until(page, "document.querySelector('#figures').textContent.includes('1 in all')")
    assert "93%" not in page.text_content("#figures")
    assert page.evaluate(inked, "left")
    assert not page.evaluate(inked, "map")
    page.wait_for_selector("#trust[data-level=unknown]")
    assert "Next: show the printed board" in page.text_content("#headline")
    running.pairs = rendered(3)
    running.command(Command(do=Do.RUN))
    shows(page, running.emit())
    page.wait_for_selector("#cloud[data-drawn]")
    assert page.evaluate(inked, "map")
    assert page.locator("#no-pair").is_hidden()
    assert complaints == []


def test_the_newest_pair_is_shown_and_numbers_only_grow(running: Played, opened: Opener) -> None:
    """Pairs come in order, each at most once, and when they stop the last one is on the page; hidden pictures are not sent."""
    page = opened("run")
    page.evaluate(
        "() => { window.seen = []; new MutationObserver(() => window.seen.push(+document.querySelector('#views').dataset.pair)).observe(document.querySelector('#views'), {attributeFilter: ['data-pair']}); }"
    )
    with playing(running, 15):
        until(page, "window.seen.length > 8")
    last = running.newest()
    assert last is not None
    shows(page, last.number)
    seen = page.evaluate("window.seen")
    assert seen == sorted(set(seen))
    page.evaluate("location.hash = 'board'")
    page.wait_for_selector("#panel-board:not([hidden])")
    page.wait_for_timeout(300)
    hidden = running.emit()
    page.wait_for_timeout(500)
    assert page.get_attribute("#views", "data-pair") == str(last.number)
    page.evaluate("location.hash = 'run'")
    shows(page, hidden)


def test_a_reload_in_the_middle_and_a_second_viewer_lose_nothing(running: Played, opened: Opener) -> None:
    """After a reload the page shows the run again and may still give commands; a second viewer sees the same pair."""
    page, second = opened("run"), opened("run", PHONE)
    with playing(running, 10):
        until(page, "+document.querySelector('#views').dataset.pair > 3")
        page.reload()
        until(page, "+document.querySelector('#views').dataset.pair > 6")
    last = running.newest()
    assert last is not None
    shows(page, last.number)
    shows(second, last.number)
    page.click("#go")
    until(page, "document.querySelector('#go').textContent === 'Start'")
    until(second, "document.querySelector('#go').textContent === 'Start'")
    assert [command.do for command in running.commands] == [Do.STOP]


def test_the_page_comes_back_with_the_host(running: Played, opened: Opener, server: PageServer) -> None:
    """When the host ends, the page says that it ended; when it is back at the same place, pairs go on without a touch."""
    page = opened("run")
    shows(page, 0)
    server.stop()
    page.wait_for_selector("body[data-line=ended]")
    page.wait_for_selector("#trust[data-level=unknown]")
    assert "The program has ended" in page.text_content("#headline")
    assert not page.is_visible("#activity")
    assert page.evaluate("() => getComputedStyle(document.querySelector('.stage')).opacity") == "0.45"
    again = PageServer(running, PageSettings(port=server.port, token=TOKEN))
    again.start()
    try:
        page.wait_for_selector("body[data-line=open]")
        page.wait_for_selector("#trust[data-level=good]")
        shows(page, running.emit())
    finally:
        again.stop()


def test_without_the_token_one_may_look_but_not_steer(
    running: Played, opened: Opener, server: PageServer, complaints: Complaints
) -> None:
    """The page without its token shows depth; Stop is refused with the way out in words, and nothing happens."""
    page = opened("run", url=server.address)
    shows(page, 0)
    page.click("#go")
    page.wait_for_selector("#run-answer.bad")
    assert "address that phone-host printed" in page.text_content("#run-answer")
    assert running.commands == []
    assert all("401" in line for line in complaints)


def test_doubts_stand_on_top_in_words_with_what_to_do(running: Played, opened: Opener) -> None:
    """A doubt comes and goes: its sentence and remedy are on top while it stands, once: in the headline or below it."""
    page = opened("run")
    page.wait_for_selector("#trust[data-level=good]")
    swapped = diagnose(Code.SWAPPED, "the cameras seem to be swapped", "swap them")
    dark = diagnose(Code.DARK, "the left image is dark", "light the scene; check --calibration or --rectified")
    running.change(concerns=(swapped, dark))
    page.wait_for_selector("#trust[data-level=bad]")
    assert "the cameras seem to be swapped. Remedy: swap them." in page.text_content("#headline")
    assert page.text_content("#concerns") == "The left image is dark. Light the scene; check Calibration."
    assert page.locator("#trust").bounding_box()["y"] < 200
    running.change(concerns=())
    page.wait_for_selector("#trust[data-level=good]")
    assert page.locator("#concerns").is_hidden()


@pytest.mark.parametrize("step", ["run", "scan"])
def test_results_that_are_too_old_are_amber_and_lead_to_the_delays(running: Played, opened: Opener, step: str) -> None:
    """No tick stands over a scene that has moved since: the sign is a warning, and its link shows the chart of the delays from any step."""
    running.change(motion_px_s=5000.0)
    page = opened(step)
    page.wait_for_selector("#trust[data-level=warning]")
    assert "the scene has moved" in page.text_content("#headline").split("But results are")[1]
    page.click("#concerns a")
    page.wait_for_selector("#panel-run:not([hidden])")
    until(page, "document.querySelector('#title-delays').getBoundingClientRect().top < innerHeight")


def test_range_and_crop_are_set_typed_or_drawn(running: Played, opened: Opener) -> None:
    """Far is sent as typed; a rectangle drawn on the depth picture becomes the crop in pixels of the left image, outlined on both pictures."""
    page = opened("run")
    shows(page, 0)
    page.fill("#far", "1500")
    page.keyboard.press("Enter")
    until(page, "document.querySelector('#settings-answer').textContent !== ''")
    page.click("#crop-draw")
    page.locator("#map-frame").scroll_into_view_if_needed()
    box = page.locator("#map-frame").bounding_box()
    at = [(box["x"] + share * box["width"], box["y"] + share * box["height"]) for share in (0.25, 0.75)]
    page.mouse.move(*at[0])
    page.mouse.down()
    page.mouse.move(*at[1], steps=3)
    page.mouse.up()
    page.wait_for_selector("#crop-clear:visible")
    assert running.settings["far"] == "1500"
    crop = [int(number) for number in running.settings["crop"].split(",")]
    assert crop == pytest.approx([160, 120, 320, 240], abs=3)
    assert page.locator(".cropped:visible").count() == 2
    page.click("#crop-clear")
    page.wait_for_selector("#crop-clear", state="hidden")
    assert "crop" not in running.settings


def test_what_is_refused_stays_to_be_mended(running: Played, opened: Opener) -> None:
    """The field keeps what was typed and is marked, and the reason stays while others are set; once it is right, both go. Escape ends the drawing of a crop."""
    page = opened("run")
    shows(page, 0)
    running.answers[Do.SET] = Answer(
        trouble=Diagnostic("--near '1 mile' is no length", "give mm, cm or m", Severity.FAIL)
    )
    page.fill("#near", "1 mile")
    page.keyboard.press("Enter")
    page.wait_for_selector("#near[aria-invalid=true]")
    running.emit()
    shows(page, 1)
    assert page.input_value("#near") == "1 mile"
    del running.answers[Do.SET]
    page.fill("#far", "2000")
    page.keyboard.press("Enter")
    page.wait_for_selector("#far[data-dirty=no]")
    assert "1 mile" in page.text_content("#settings-answer")
    page.fill("#near", "300")
    page.keyboard.press("Enter")
    page.wait_for_selector("#near[aria-invalid=false]")
    assert "1 mile" not in page.text_content("#settings-answer")
    page.click("#crop-draw")
    page.wait_for_selector("#crop-draw[aria-pressed=true]")
    page.keyboard.press("Escape")
    page.wait_for_selector("#crop-draw[aria-pressed=false]")


def test_a_page_beside_a_run_has_nothing_to_set(running: Played, opened: Opener) -> None:
    """Neither steps nor settings: only Stop and a snapshot. When the run is over, nothing offers to start another."""
    running.change(steps=())
    page = opened("board")
    shows(page, 0)
    for there in ("nav", ".settings", "#panel-board"):
        assert page.locator(there).is_hidden()
    assert page.text_content("#go") == "Stop"
    running.change(activity=Activity.IDLE)
    page.wait_for_selector("#go", state="hidden")


@pytest.mark.usefixtures("running")
def test_the_cloud_turns_by_keys_and_without_webgl_a_sentence_stands_there(
    opened: Opener, browser: Any, server: PageServer
) -> None:
    """Arrow keys and plus change the view and Home undoes it; a browser without WebGL 2 says so and shows all else."""
    page = opened("run", {"width": 1000, "height": 700})
    page.wait_for_selector("#cloud[data-drawn]")
    start = page.get_attribute("#cloud", "data-drawn")
    page.focus("#cloud")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        before = page.get_attribute("#cloud", "data-drawn")
        page.keyboard.press(key)
        page.wait_for_function("was => document.querySelector('#cloud').dataset.drawn !== was", arg=before)
    page.keyboard.press("Home")
    page.wait_for_function("was => document.querySelector('#cloud').dataset.drawn === was", arg=start)
    bare = browser.new_page()
    bare.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext; HTMLCanvasElement.prototype.getContext = function (kind, ...rest) { return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest); };"
    )
    bare.goto(server.url)
    bare.wait_for_selector("#cloud-none:visible")
    assert "no WebGL 2" in bare.text_content("#cloud-none")
    shows(bare, 0)
    bare.close()


@pytest.mark.parametrize("size", [PHONE, LAPTOP], ids=["phone", "laptop"])
def test_nothing_jumps_and_nothing_is_wider_than_the_window(
    running: Played, opened: Opener, complaints: Complaints, size: dict[str, int]
) -> None:
    """While pairs and numbers change, no part of the page moves (the browser's own measure of it), and nothing sticks out."""
    page = opened("run", size)
    shows(page, 0)
    with playing(running, 10):
        until(page, "+document.querySelector('#views').dataset.pair > 8")
        page.evaluate(
            "() => { window.moved = 0; new PerformanceObserver(list => list.getEntries().forEach(one => window.moved += one.value)).observe({type: 'layout-shift'}); }"
        )
        until(page, "+document.querySelector('#views').dataset.pair > 25")
    assert page.evaluate("window.moved") < 0.005
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    assert complaints == []


@pytest.mark.usefixtures("running")
def test_the_page_is_light_and_asks_nobody_else(opened: Opener, complaints: Complaints) -> None:
    """To the first depth and cloud at most 450 KB are transferred, all from the server itself; over 100 KB/s it still comes."""
    page = opened()
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    session.send("Network.setCacheDisabled", {"cacheDisabled": True})
    session.send(
        "Network.emulateNetworkConditions",
        {"offline": False, "latency": 40, "downloadThroughput": 100_000, "uploadThroughput": 100_000},
    )
    asked: set[str] = set()
    sizes: list[float] = []

    def on_finished(event: dict[str, Any]) -> None:
        """Count what this page asked for, and not what the page before the reload was still waiting for."""
        if event["requestId"] in asked:
            sizes.append(event["encodedDataLength"])

    session.on("Network.requestWillBeSent", lambda event: asked.add(event["requestId"]))
    session.on("Network.loadingFinished", on_finished)
    began_ns = now.monotonic_ns()
    page.reload()
    page.evaluate("location.hash = 'run'")
    shows(page, 0)
    page.wait_for_selector("#cloud[data-drawn]")
    print(
        f"{sum(sizes) / 1000:.0f} KB; depth and cloud after {(now.monotonic_ns() - began_ns) / 1e9:.1f} s at 100 KB/s"
    )
    assert 100_000 < sum(sizes) < MOST_BYTES
    assert complaints == []
