"""This browser as the camera: Firefox, whose page has no MediaStreamTrackProcessor and takes the other way."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Choice, StepName
from tests.support.played_feed import PlayedFeed
from tests.web.conftest import TOKEN
from tests.web.firefox import ALLOWED, DENIED, FIREFOX, firefox
from tests.web.played import CAMERAS, Played

pytestmark = pytest.mark.skipif(FIREFOX is None, reason="needs firefox")


@pytest.fixture
def camera() -> PlayedFeed:
    """What the real server hands the browser's camera to."""
    return PlayedFeed(welcome={"want": {"encoding": "jpeg", "quality": 0.9}, "locks": None})


@pytest.fixture
def server(camera: PlayedFeed) -> Iterator[PageServer]:
    """The real server; the camera is to be a browser's."""
    choices = (*CAMERAS, Choice(uri="browser:", name="A browser's camera"))
    program = Played((), settings={"camera": "browser:"}, cameras=choices, done={StepName.BOARD}, feed=camera)
    serving = PageServer(program, PageSettings(port=0, token=TOKEN))
    serving.start()
    yield serving
    serving.stop()


def test_firefox_films_by_the_other_way(camera: PlayedFeed, server: PageServer, tmp_path: Path) -> None:
    """JPEGs and luma arrive in order, whole, in the size that was told, with stamps that grow; the page says that it streams."""
    with firefox(tmp_path, ALLOWED) as page:
        page.goto(server.url)
        page.until("document.body.dataset.line === 'open'")
        page.evaluate("location.hash = 'camera'")
        page.until("document.querySelector('#own-go[data-running=no]') !== null")
        page.evaluate("document.querySelector('#own-go').click()")
        camera.until(lambda: len(camera.frames) >= 20)
        camera.tell(kind="want", encoding="luma")
        camera.until(lambda: len([each for each in camera.frames if each.is_luma]) >= 20)
        words = page.until("document.getElementById('own-words').textContent.startsWith('Streaming')")
        frames = list(camera.frames)
    hello = camera.of_kind("hello")[0]
    assert hello["path"] == "video-frame"
    assert words
    size = hello["settings"]["width"], hello["settings"]["height"]
    assert {(each.width, each.height) for each in frames} == {size}
    for each in (each for each in frames if not each.is_luma):
        decoded = cv2.imdecode(np.frombuffer(each.payload, np.uint8), cv2.IMREAD_GRAYSCALE)
        assert decoded is not None
        assert decoded.shape == size[::-1]
    assert {len(each.payload) for each in frames if each.is_luma} == {size[0] * size[1]}
    assert (np.diff([each.sequence for each in frames]) > 0).all()
    assert (np.diff([each.timestamp_us for each in frames]) >= 0).all()  # they count in steps of 11.6 ms
    assert all(each.callback_us <= each.encoded_us <= each.sent_us for each in frames)


_LOCKS = """window.locks = []; {
  const own = navigator.wakeLock.request.bind(navigator.wakeLock);
  navigator.wakeLock.request = async kind => { const lock = await own(kind); window.locks.push(lock); return lock; };
}"""
_HELD = "window.locks.filter(lock => !lock.released).length"


def test_behind_another_tab_it_says_so_and_in_front_it_goes_on(
    camera: PlayedFeed, server: PageServer, tmp_path: Path
) -> None:
    """The program is told at once; the screen's wake lock, which the browser takes from hidden tabs, is asked for again in front, and given back by Stop."""
    with firefox(tmp_path, ALLOWED) as page:
        page.goto(server.url)
        page.until("document.body.dataset.line === 'open'")
        page.evaluate(_LOCKS)
        page.evaluate("location.hash = 'camera'")
        page.until("document.querySelector('#own-go[data-running=no]') !== null")
        page.evaluate("document.querySelector('#own-go').click()")
        camera.until(lambda: camera.frames)
        page.until(f"{_HELD} === 1")
        with page.behind():
            page.until("document.visibilityState === 'hidden'")
            camera.until(lambda: not camera.of_kind("track")[-1]["visible"])
            page.until("document.getElementById('own-words').textContent.startsWith('This tab is in the background')")
            page.until(f"{_HELD} === 0")
        camera.until(lambda: camera.of_kind("track")[-1]["visible"])
        page.until("document.getElementById('own-words').textContent.startsWith('Streaming')")
        last = camera.frames[-1].received_ns
        camera.until(lambda: camera.frames[-1].received_ns > last)
        page.until(f"{_HELD} === 1")
        page.evaluate("document.querySelector('#own-go').click()")
        page.until(f"{_HELD} === 0")


def test_firefox_without_permission_says_what_to_do(camera: PlayedFeed, server: PageServer, tmp_path: Path) -> None:
    """A person who refused the camera reads where to allow it; no frame is sent."""
    with firefox(tmp_path, DENIED) as page:
        page.goto(server.url)
        page.until("document.body.dataset.line === 'open'")
        page.evaluate("location.hash = 'camera'")
        page.until("document.querySelector('#own-go[data-running=no]') !== null")
        page.evaluate("document.querySelector('#own-go').click()")
        state = page.until(
            "document.getElementById('own-state').innerText.includes('allow') && document.getElementById('own-state').innerText"
        )
    assert "camera" in state
    assert camera.frames == []
