"""The page shows all of a wide cloud, both cameras while it calibrates, and is told by touch on a phone; its words are its own."""

from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.web.server import PageServer
from phone_host.web.source import Activity, StepName
from tests.web.conftest import PHONE, Opener
from tests.web.played import Played, guide_snapshot


def test_a_crop_is_drawn_by_touch_where_the_words_stand(program: Played, opened: Opener) -> None:
    """On a phone that shows the cloud: the depth picture comes up with the words at it, a finger draws, the answer stands there."""
    program.change(activity=Activity.RUNNING, done=set(StepName))
    program.emit()
    page = opened("run", PHONE)
    page.wait_for_selector("#views[data-pair]")
    page.check("input[value=cloud]", force=True)
    page.tap("#crop-draw")
    words, frame = (page.locator(place).bounding_box() for place in ("#crop-answer", "#map-frame"))
    assert "Drag a rectangle" in page.text_content("#crop-answer")
    assert 0 <= words["y"] < frame["y"] < PHONE["height"] - frame["height"]
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *shares: float) -> None:
        points = [
            {"x": frame["x"] + each * frame["width"], "y": frame["y"] + each * frame["height"]} for each in shares
        ]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 0.25)
    for share in (0.3, 0.5, 0.75):
        touch("touchMove", share)
    touch("touchEnd")
    page.wait_for_selector("#crop-clear:not([hidden])", state="attached")
    crop = [int(number) for number in program.settings["crop"].split(",")]
    assert crop == pytest.approx([160, 120, 320, 240], abs=4)
    page.wait_for_function("() => document.querySelector('#crop-answer').textContent === 'Set: done.'")
    assert page.locator("#crop-stop").is_hidden()
    page.click("#crop-draw")
    page.click("#crop-stop")
    page.wait_for_selector("#crop-draw[aria-pressed=false]")
    assert page.locator("#crop-answer").is_hidden()


@pytest.mark.parametrize("size", [PHONE, {"width": 1366, "height": 768}], ids=["phone", "laptop"])
def test_both_cameras_are_seen_while_calibrating(program: Played, opened: Opener, size: dict[str, int]) -> None:
    """Their newest pictures lie under what is covered, each where it belongs, and nothing of them is taken for a run's."""
    program.change(activity=Activity.CALIBRATING, guide=guide_snapshot(), begun=1)
    page = opened("calibration", size)
    number = program.emit()
    page.wait_for_selector("#guide-left")
    shown = program.pairs[number % len(program.pairs)].pair
    for side, image in (("left", shown.left), ("right", shown.right)):
        page.wait_for_function(
            "side => { const c = document.getElementById(`guide-${side}`); return c.getContext('2d').getImageData(8, 8, 1, 1).data[3] === 255; }",
            arg=f"{side}",
        )
        seen = page.evaluate(
            """side => { const c = document.getElementById(`guide-${side}`), small = new OffscreenCanvas(64, 48), pen = small.getContext('2d');
            pen.drawImage(c, 0, 0, 64, 48); return [...pen.getImageData(0, 0, 64, 48).data]; }""",
            side,
        )
        picture = np.array(seen, np.uint8).reshape(48, 64, 4)[..., :3].mean(axis=2)
        grey = cv2.resize(image, (64, 48), interpolation=cv2.INTER_AREA).reshape(48, 64, -1).mean(axis=2)
        assert np.corrcoef(picture.ravel(), grey.ravel())[0, 1] > 0.7
    box = page.locator("#guide-right").bounding_box()
    assert box["x"] + box["width"] <= size["width"]
    program.change(activity=Activity.IDLE)
    page.evaluate("location.hash = 'run'")
    page.wait_for_selector("#no-pair:visible")
    assert page.text_content("#no-pair") == "No pair yet"


def test_the_first_address_may_name_the_step(browser: Any, server: PageServer) -> None:
    """The token goes out of the address, the step stays; a wrong token takes nobody's place."""
    page = browser.new_page()
    page.goto(f"{server.url}#check")
    page.wait_for_selector("#panel-check:visible")
    assert page.url == f"{server.address}#check"
    page.goto(f"{server.address}?token=wrong#camera")
    page.wait_for_selector("#panel-camera:visible")
    assert page.url == f"{server.address}#camera"
    assert page.evaluate("localStorage.getItem('token')") == server.token
    page.close()


def test_words_of_the_command_line_are_those_of_the_page(opened: Opener) -> None:
    """An option that has a field is called by the field's name; commands, and options without a field, stay."""
    page = opened()
    for told, shown in {
        "--square is 'bogus'": "Square is 'bogus'.",
        "--near 9m is not nearer than --far 1m": "Near 9m is not nearer than Far 1m.",
        "check that --calibration or --rectified fits": "Check that Calibration fits.",
        "check --board, or name that board with --board; see --help": "Check Inner corners, or name that board with Inner corners.",
        "--board-side left contradicts it": "--board-side left contradicts it.",
        "give --near 0.65m without --disparities, or --disparities 80.": "Give Near 0.65m.",
        "divide, as in --square 25mm; or as in --square '2px*1mm'": "Divide, as in 25mm; or as in '2px*1mm'.",
        "give a larger --tolerance": "Give a larger --tolerance.",
        "run `phone-host run --near 3`": "Run \u201cphone-host run --near 3\u201d.",
    }.items():
        said = page.evaluate("async words => (await import('/static/dom.js')).sentence(words)", told)
        assert said == shown


def test_a_view_shows_all_of_a_cloud(opened: Opener) -> None:
    """From where the camera stands, every point lies within its angle but for a few strays, and both edges are reached."""
    page = opened()
    rng = np.random.default_rng(5)
    away = rng.uniform(-0.5, 6.0, 2000)
    across = rng.uniform(-1, 1, 2000) * (away + 1.5) + 0.7 * away
    points = [{"across": a, "away": b} for a, b in zip(across.tolist(), away.tolist(), strict=True)]
    stands = page.evaluate("async points => (await import('/static/depth.js')).fitted(points, 0.5)", points)
    share = (across - stands["aside"]) / (away + stands["back"]) / 0.5
    assert (away + stands["back"] > 0).all()
    assert np.mean(np.abs(share) <= 1 + 1e-9) >= 0.99
    assert share.min() < -0.97
    assert share.max() > 0.97
