"""This browser as the camera: Chromium with its built-in camera, the real page and server, and a program that is played."""

import time
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Choice, StepName
from tests.support.played_feed import BUSY, PlayedFeed
from tests.web.conftest import LAPTOP, OTHER_NAME, PHONE, TOKEN, Complaints, Opener
from tests.web.played import CAMERAS, Played

BROWSERS = Choice(uri="browser:", name="A browser's camera")


@pytest.fixture
def camera() -> PlayedFeed:
    """What the real server hands the browser's camera to."""
    return PlayedFeed()


@pytest.fixture
def program(camera: PlayedFeed) -> Played:
    """A program whose camera is to be a browser's."""
    cameras = (*CAMERAS, BROWSERS)
    return Played((), settings={"camera": "browser:"}, cameras=cameras, done={StepName.BOARD}, feed=camera)


@pytest.fixture
def server(program: Played) -> Iterator[PageServer]:
    """The real server; it is known by another name, too."""
    serving = PageServer(program, PageSettings(port=0, token=TOKEN, names=(OTHER_NAME,)))
    serving.start()
    yield serving
    serving.stop()


def started(opened: Opener, *, permissions: tuple[str, ...] = ("camera",), script: str = "", **options: Any) -> Any:
    """Open the page at the camera's step and start the camera."""
    page = opened(permissions=list(permissions), **options)
    if script:
        page.add_init_script(script)
        page.reload()
    page.evaluate("() => { location.hash = 'camera'; }")
    page.wait_for_selector("#own-go[data-running=no]")
    page.click("#own-go")
    return page


def focus(camera: PlayedFeed) -> dict[str, Any]:
    """What the page has told of the focus last: asked and got."""
    told = camera.of_kind("locked")
    values: dict[str, Any] = told[-1]["groups"]["focus"] if told else {"asked": {}, "got": {}}
    return values


def says(page: Any, words: str) -> str:
    """Wait until the camera's state begins with these words; return it whole, with what to do."""
    page.wait_for_function("words => document.getElementById('own-words').textContent.startsWith(words)", arg=words)
    return str(page.inner_text("#own-state"))


def test_frames_arrive_whole_in_order_and_with_stamps_of_their_own(
    camera: PlayedFeed, opened: Opener, complaints: Complaints
) -> None:
    """Sequences grow, JPEG and luma have the size that was asked for, stamps are in the order of events and the camera's are even; the clock's echoes map them to this machine."""
    camera.welcome = {"want": {"encoding": "jpeg", "quality": 0.9}, "locks": None}
    page = started(opened)
    camera.until(lambda: len(camera.frames) >= 20)
    camera.tell(kind="want", encoding="luma")
    camera.until(lambda: len([each for each in camera.frames if each.is_luma]) >= 20)
    frames = list(camera.frames)
    assert (np.diff([each.sequence for each in frames]) > 0).all()
    assert {(each.width, each.height) for each in frames} == {(640, 480)}
    coded = [
        cv2.imdecode(np.frombuffer(each.payload, np.uint8), cv2.IMREAD_GRAYSCALE) for each in frames if not each.is_luma
    ]
    plain = [np.frombuffer(each.payload, np.uint8).reshape(480, 640) for each in frames if each.is_luma]
    assert {picture.shape for picture in coded if picture is not None} == {(480, 640)}
    # The built-in camera's pie goes round once a second: of each picture there is one like it the other way.
    small = np.array([picture[::8, ::8].ravel() for picture in (*coded, *plain) if picture is not None])
    assert np.corrcoef(small)[: len(coded), len(coded) :].max() > 0.9
    for each in frames:
        assert each.callback_us <= each.encoded_us <= each.sent_us
        assert each.callback_us - each.timestamp_us == pytest.approx(
            frames[0].callback_us - frames[0].timestamp_us, abs=1e6
        )
    hello = camera.of_kind("hello")[0]
    periods_us = np.diff([each.timestamp_us for each in frames]) / np.diff([each.sequence for each in frames])
    assert np.median(periods_us) == pytest.approx(1e6 / hello["settings"]["frameRate"], rel=0.2)
    camera.until(lambda: len(camera.offsets_us) > 20)
    trip_us, offset_us = min(camera.offsets_us)
    delays_us = [each.received_ns / 1000 - (each.sent_us + offset_us) for each in frames]
    assert min(delays_us) > -trip_us
    assert np.median(delays_us) < 1e6
    assert (hello["path"], hello["isolated"]) == ("processor", True)
    assert hello["settings"]["width"] == 640
    assert says(page, "Streaming")
    assert complaints == []


def test_without_credit_nothing_is_sent_and_what_is_dropped_is_counted(camera: PlayedFeed, opened: Opener) -> None:
    """The page sends exactly what was granted; each frame's count of dropped ones is what its sequence says."""
    camera.window = None
    page = started(opened)
    says(page, "Ready: no step needs frames now")
    assert camera.frames == []
    camera.grant(3)
    camera.until(lambda: len(camera.frames) == 3)
    page.wait_for_function(
        "most => Number(document.querySelector('#own-figures [data-key=dropped] .value').textContent) > most",
        arg=camera.frames[-1].dropped + 20,
    )
    assert len(camera.frames) == 3
    camera.grant(4)
    camera.until(lambda: len(camera.frames) == 4)
    assert camera.frames[-1].sequence > camera.frames[-2].sequence + 20
    assert [each.sequence - each.dropped for each in camera.frames] == [0, 1, 2, 3]
    camera.tell(kind="told", words="turned: frames are not used")
    says(page, "Turned: frames are not used")


def test_settings_are_held_group_by_group_and_read_back(camera: PlayedFeed, opened: Opener) -> None:
    """Focus and exposure settle, are held and read back; the program's own values are set; what the camera does not have is refused by name; a group that cannot be let go is told."""
    page = started(opened)
    camera.until(lambda: focus(camera)["asked"])
    held = camera.of_kind("locked")[-1]
    assert held["refused"] == {}
    assert held["groups"]["exposure"]["got"] == held["groups"]["exposure"]["asked"]
    camera.tell(kind="lock", groups={"focus": {"focusMode": "manual", "focusDistance": 40}, "zoom": {"zoom": 2}})
    camera.until(lambda: focus(camera)["got"] == {"focusMode": "manual", "focusDistance": 40})
    told = camera.of_kind("locked")[-1]
    assert told["groups"]["exposure"] == held["groups"]["exposure"]
    assert list(told["refused"]) == ["zoom"]
    page.uncheck("#own-groups [data-key=focus] input")
    camera.until(lambda: not focus(camera)["asked"])
    # The built-in camera promises an automatic mode and stays manual: what it says counts, not what was asked.
    assert focus(camera)["got"] == {"focusMode": "manual"}
    assert "does not go back" in camera.of_kind("locked")[-1]["refused"]["focus"]
    page.wait_for_selector("#own-groups [data-key=focus] output[data-level=bad]")
    camera.until(lambda: camera.frames)
    assert camera.frames[-1].exposure_us == 100 * held["groups"]["exposure"]["got"]["exposureTime"]


def test_a_camera_that_cannot_be_had_is_told_with_its_remedy(camera: PlayedFeed, opened: Opener) -> None:
    """Not allowed: how to allow it, and Start is offered again. Taken by another program: it is tried again, and comes by itself."""
    # Both failures are made up: nobody can take Chromium's built-in camera away. Firefox is refused by its own permission (test_firefox_camera).
    failing = """const own = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices), names = ['NotAllowedError', 'NotReadableError'];
    navigator.mediaDevices.getUserMedia = async wish => { if (names.length) throw new DOMException('', names.shift()); return own(wish); };"""
    page = started(opened, script=failing)
    assert "allow the camera" in says(page, "The browser does not allow the camera")
    assert page.text_content("#own-go") == "Start"
    page.click("#own-go")
    assert "Close other camera apps" in says(page, "Another program is using the camera")
    assert says(page, "Streaming")
    assert camera.frames
    page.evaluate(
        "() => { const track = document.getElementById('own-video').srcObject.getVideoTracks()[0]; track.stop(); track.dispatchEvent(new Event('ended')); }"
    )
    assert "tries again by itself" in says(page, "The camera was disconnected")
    camera.until(lambda: any(not each["live"] for each in camera.of_kind("track")))
    says(page, "Streaming")
    assert len({each["track"] for each in camera.of_kind("hello")}) == 2


def test_each_state_has_words_of_its_own_and_what_to_do(opened: Opener) -> None:
    """Whatever becomes of the camera is said in other words than the rest, and what is not good comes with a remedy."""
    page = opened("camera")
    good: dict[str, Any] = {
        "isSecure": True,
        "phase": "on",
        "failure": "",
        "isEnded": False,
        "isMuted": False,
        "isVisible": True,
        "isTurned": False,
        "line": "open",
        "refusal": {"problem": "busy", "remedy": "wait"},
        "trouble": "",
        "told": "",
        "isAsked": True,
    }
    others: list[dict[str, Any]] = [
        {"isSecure": False}, {"phase": "off"}, {"phase": "opening"}, {"isEnded": True}, {"isMuted": True}, {"isVisible": False},
        {"isTurned": True}, {"line": "connecting"}, {"line": "lost"}, {"line": "refused"}, {"trouble": "x"}, {"told": "turned"}, {"isAsked": False},
        *({"phase": "failed", "failure": f"{name}Error"} for name in ("NotAllowed", "NotFound", "NotReadable", "Overconstrained", "NotSupported", "Other")),
    ]  # fmt: skip
    told = page.evaluate(
        "async all => { const { stateOf } = await import('/static/camera_words.js'); return all.map(stateOf); }",
        [good, *(good | other for other in others)],
    )
    assert len({each["words"] for each in told}) == len(told)
    without = [each["words"] for each in told if each["level"] in {"warning", "bad"} and not each["remedy"]]
    assert without == ["turned"]  # the program's own words, whole


def test_one_browser_feeds_and_a_second_is_told_so_until_the_first_stops(camera: PlayedFeed, opened: Opener) -> None:
    """The second shows the program's words and becomes the camera by itself once the first has stopped, which says goodbye."""
    first = started(opened)
    says(first, "Streaming")
    second = started(opened)
    assert BUSY["remedy"][1:] in says(second, "Another browser is the camera")
    first.click("#own-go")
    says(first, "The camera is off")
    says(second, "Streaming")
    assert len(camera.of_kind("bye")) == 1
    assert len({each["track"] for each in camera.of_kind("hello")}) == 2


def test_a_tab_in_the_background_says_so_on_both_sides(camera: PlayedFeed, opened: Opener) -> None:
    """The program is told at once that the tab is hidden; the page says what to do, and streams again in front."""
    page = started(opened)
    says(page, "Streaming")
    show = "state => { Object.defineProperty(document, 'visibilityState', { value: state, configurable: true }); document.dispatchEvent(new Event('visibilitychange')); }"
    page.evaluate(show, "hidden")
    assert "Bring it to the front" in says(page, "This tab is in the background")
    camera.until(lambda: not camera.of_kind("track")[-1]["visible"])
    page.evaluate(show, "visible")
    says(page, "Streaming")
    camera.until(lambda: camera.of_kind("track")[-1]["visible"])


def test_a_phone_that_is_turned_says_so_until_it_is_turned_back(camera: PlayedFeed, opened: Opener) -> None:
    """Chromium itself tells that the screen has turned; frames carry the turn, the page asks to turn back, and streams again then."""
    page = started(opened, size=PHONE, is_mobile=True)
    says(page, "Streaming")
    screen = page.context.new_cdp_session(page)

    def turn(kind: str, angle: int, width: int, height: int) -> None:
        held = {"type": kind, "angle": angle}
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": True}
        screen.send("Emulation.setDeviceMetricsOverride", {**size, "screenOrientation": held})

    turn("landscapePrimary", 90, 844, 390)
    assert "Turn it back" in says(page, "The phone was turned")
    camera.until(lambda: camera.of_kind("track")[-1]["rotation"] == 90)
    camera.until(lambda: camera.frames[-1].rotation == 90)
    turn("portraitPrimary", 0, 390, 844)
    says(page, "Streaming")
    camera.until(lambda: camera.frames[-1].rotation == 0)


def test_the_screen_stays_on_while_it_is_a_camera(opened: Opener) -> None:
    """The browser's wake lock is held from the start of the camera to its stop."""
    keeping = """window.locks = []; const own = navigator.wakeLock.request.bind(navigator.wakeLock);
    navigator.wakeLock.request = async kind => { const lock = await own(kind); window.locks.push(lock); return lock; };"""
    page = started(opened, permissions=("camera", "screen-wake-lock"), script=keeping)
    says(page, "Streaming")
    page.wait_for_function("() => window.locks.length === 1 && !window.locks[0].released")
    assert page.evaluate("() => window.locks[0].type") == "screen"
    page.click("#own-go")
    says(page, "The camera is off")
    page.wait_for_function("() => window.locks[0].released")


def test_when_the_program_goes_and_comes_the_same_camera_goes_on(camera: PlayedFeed, opened: Opener) -> None:
    """The page says that nobody answers, comes back by itself, and goes on with its numbers; a page that is loaded again is the camera again."""
    page = started(opened)
    camera.until(lambda: len(camera.frames) > 5)
    camera.is_away = True
    camera.hang_up()
    says(page, "The program does not answer")
    last = camera.frames[-1]
    camera.is_away = False
    says(page, "Streaming")
    camera.until(lambda: camera.frames[-1].received_ns > last.received_ns)
    assert len({each["track"] for each in camera.of_kind("hello")}) == 1
    after = next(each for each in camera.frames if each.received_ns > last.received_ns)
    assert after.sequence > last.sequence
    assert after.dropped > last.dropped
    page.reload()
    says(page, "Streaming")
    assert len({each["track"] for each in camera.of_kind("hello")}) == 2


def test_a_browser_without_frame_streams_hands_over_frames_all_the_same(
    camera: PlayedFeed, opened: Opener, complaints: Complaints
) -> None:
    """Without MediaStreamTrackProcessor frames come by way of a video: in order, in size, with the time of their capture; also from another step of the page."""
    camera.welcome = {"want": {"encoding": "luma"}, "locks": None}
    page = started(opened, script="delete window.MediaStreamTrackProcessor;")
    camera.until(lambda: len(camera.frames) >= 10)
    assert camera.of_kind("hello")[0]["path"] == "video-frame"
    assert (np.diff([each.sequence for each in camera.frames]) > 0).all()
    frame = camera.frames[-1]
    assert (frame.width, frame.height, len(frame.payload)) == (640, 480, 640 * 480)
    assert (np.diff([each.timestamp_us for each in camera.frames]) > 0).all()
    captured = [each for each in camera.frames if not np.isnan(each.capture_us)]
    assert captured
    assert all(0 <= each.callback_us - each.capture_us < 1e6 for each in captured)
    page.click("#step-check")
    page.wait_for_selector("#panel-camera[hidden]", state="attached")
    count = len(camera.frames)
    camera.until(lambda: len(camera.frames) > count + 5)
    assert page.is_visible("#own-chip")
    assert complaints == []


def test_another_size_is_another_track_and_a_size_it_lacks_is_told(camera: PlayedFeed, opened: Opener) -> None:
    """The program's size counts; the person's choice, too; frames of one connection have one size."""
    page = started(opened)
    camera.until(lambda: camera.frames)
    camera.tell(kind="want", width=1280, height=720, fps=None)
    camera.until(lambda: camera.frames[-1].width == 1280)
    assert camera.frames[-1].height == 720
    assert len({each["track"] for each in camera.of_kind("hello")}) == 2
    assert page.input_value("#own-size") == "1280x720"
    camera.tell(kind="want", width=500, height=300, fps=None)
    page.wait_for_selector("#own-answer:has-text('does not have this size')")
    camera.until(lambda: any("does not have" in each.get("words", "") for each in camera.said))
    count = len(camera.of_kind("hello"))
    time.sleep(0.5)
    assert len(camera.of_kind("hello")) == count


def test_an_address_that_the_browser_does_not_trust_is_told_with_the_ways_out(
    server: PageServer, opened: Opener
) -> None:
    """Where the browser keeps its camera back, three ways are named, with the page's own port; nothing is offered that cannot work."""
    page = opened("camera", url=server.url_at(OTHER_NAME))
    words = says(page, "The browser blocks its camera at this address")
    assert "Open the page in one of these ways" in words
    ways = page.text_content("#own-ways")
    assert f"adb reverse tcp:{server.port} tcp:{server.port}" in ways
    assert "serve --lan" in ways
    assert not page.is_visible("#own-go")


def test_only_who_is_the_camera_loads_it(program: Played, opened: Opener) -> None:
    """The page's policy gives the camera to itself alone. Its modules are not loaded on other steps; another camera that is chosen ends it; beside a run, which has no steps, it stands above the run."""
    program.change(done={StepName.BOARD, StepName.CAMERA})
    page = opened("board")
    policy = page.evaluate("async () => (await fetch('/')).headers.get('Permissions-Policy')")
    assert "camera=(self)" in policy.split(", ")
    loaded: list[str] = []
    page.on("request", lambda asked: loaded.append(asked.url.rpartition("/")[2]))
    page.click("#step-run")
    page.wait_for_timeout(300)
    assert [name for name in loaded if name.startswith("camera")] == []
    page.click("#step-camera")
    says(page, "The camera is off")
    assert "camera.js" in loaded
    page.check(f"input[value='{CAMERAS[0].uri}']")
    page.wait_for_selector("#own", state="hidden")
    program.change(steps=(), settings={"camera": "browser:"})
    page.wait_for_selector("#panel-run #own-go")


@pytest.mark.parametrize(("size", "scheme"), [(PHONE, "dark"), (LAPTOP, "light")], ids=["phone", "laptop"])
def test_it_can_be_used_by_all_and_nothing_jumps(
    opened: Opener,
    axe: str,
    size: dict[str, int],
    scheme: str,
) -> None:
    """axe-core finds nothing, off and on; what is pressed stays where it is from the first picture on; nothing is wider than the window; keys reach all of it."""
    page = started(opened, size=size, color_scheme=scheme, bypass_csp=True)
    where = "() => ['own-go', 'own-device', 'own-size', 'own-video'].map(id => document.getElementById(id).getBoundingClientRect()).map(r => [r.x, r.y + scrollY])"
    before = page.evaluate(where)
    page.wait_for_selector("#own-groups [data-key=exposure]")
    says(page, "Streaming")
    page.wait_for_function("() => document.querySelector('#own-figures [data-key=frames] .value').textContent > 0")
    assert page.evaluate(where) == before
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    page.evaluate(axe)
    said = page.evaluate("() => axe.run('#own')")
    assert [one["id"] for one in said["violations"]] == []
    page.focus("#own-go")
    reached = []
    for _ in range(6):
        page.keyboard.press("Tab")
        reached.append(
            page.evaluate("() => document.activeElement.id || document.activeElement.closest('label')?.dataset.key")
        )
    assert {"own-device", "own-size", "own-rate", "focus", "exposure"} <= set(reached)
