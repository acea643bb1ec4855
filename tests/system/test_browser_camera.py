"""A browser's camera over the page's real server, played by a program: it comes, goes, lies, and is paired with a board's."""

import asyncio
import json
import re
import select
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import cv2
import numpy as np
import pytest

from common import now
from common.camera.base import CameraState, Grab, held_locks, lockable
from common.camera_identity import Lock
from common.errors import UnavailableError
from common.frame import Frame, FrameFault, PixelFormat
from phone_host.camera.browser import BrowserCamera
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.doctor.capture import source_of
from phone_host.web.server import PageServer
from phone_host.web.settings import LIMITS, Limits, PageSettings
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, draw, saved_numbers, write_film
from tests.support.page_client import page
from tests.support.page_source import PageSource
from tests.support.pictures import jpeg
from tests.support.programs import board, host, ledgers, until
from tests.support.scripted_browser import LUMA, Script, ScriptedBrowser, Shot

SHOTS = tuple(Shot(payload=jpeg(seed=seed), width=32, height=24) for seed in range(5))
LUMA_SHOT = Shot(payload=bytes(32 * 24), width=32, height=24, encoding=LUMA)
PATIENCE_NS = 30_000_000_000


class World:
    """A page's server with its feed, and what uses it."""

    def __init__(self, patience_ns: int, limits: Limits) -> None:
        self.feed = BrowserFeed(patience_ns)
        source = PageSource()
        source.feed = self.feed
        self.server = PageServer(source, PageSettings(port=0), limits)
        self.came: list[Grab] = []

    def browser(self, **script: Any) -> ScriptedBrowser:
        """A browser, not yet come."""
        return ScriptedBrowser(self.server.url, Script(**({"shots": SHOTS} | script)))

    @contextmanager
    def camera(self, uri: str = "browser:") -> Iterator[BrowserCamera]:
        """The camera, open while the block lasts."""
        camera = open_camera(uri, "host", now.monotonic_ns(), feed=self.feed)
        assert isinstance(camera, BrowserCamera)
        try:
            yield camera
        finally:
            camera.close()

    def read(self, camera: BrowserCamera, enough: Callable[[], bool]) -> None:
        """Read until something holds."""

        def step() -> bool:
            assert camera.pollable is not None
            select.select([camera.pollable], [], [], 0.1)
            self.came += camera.read(now.monotonic_ns())
            return enough()

        until(step, "images")

    @property
    def frames(self) -> list[Frame]:
        """The frames that came."""
        return [grab for grab in self.came if isinstance(grab, Frame)]


@contextmanager
def world(patience_ns: int = PATIENCE_NS, limits: Limits = LIMITS) -> Iterator[World]:
    """A server while the block lasts."""
    made = World(patience_ns, limits)
    made.server.start()
    try:
        yield made
    finally:
        made.server.stop()


def test_stamps_come_onto_the_hosts_clock_with_a_true_uncertainty() -> None:
    """Images exposed at k / fps get that time, whatever the browser's clock counts from; on its own clock, within the stated uncertainty."""
    with world() as made, made.browser(epoch_us=-1.7e15) as browser, made.camera() as camera:
        made.read(camera, lambda: len(made.frames) >= 20)
        for frame in made.frames:
            error_ns = abs(frame.exposed.ns - round(round(frame.exposed.ns * 30e-9) / 30 * 1e9))
            assert error_ns <= frame.uncertainty_ns <= frame.bound_ns
        origin = camera.health.origin
        assert origin is not None
        assert origin.epoch == "the browser's own clock"
        assert browser.told("credit")


def test_a_browser_that_goes_and_comes_is_a_camera_that_was_unplugged() -> None:
    """While it is away the camera is gone, and it is back in the same session; another camera is not taken instead, and is told why."""
    with world() as made, made.browser() as browser, made.camera() as camera:
        made.read(camera, lambda: len(made.frames) >= 5)
        browser.leave()
        made.read(camera, lambda: camera.health.state is CameraState.GONE)
        before = len(made.frames)
        browser.come()
        made.read(camera, lambda: len(made.frames) > before + 5)
        assert (camera.health.unplugged, camera.health.returned) == (1, 1)
        assert [frame.sequence for frame in made.frames] == sorted({frame.sequence for frame in made.frames})
        browser.leave()
        made.read(camera, lambda: camera.health.state is CameraState.GONE)
        with made.browser(device="d1", track="t1") as other:
            made.read(camera, lambda: bool(other.told("refused")))
            assert "another camera" in other.told("refused")[0]["problem"]
            browser.come()
            made.read(camera, lambda: camera.health.returned == 2)


def test_a_second_browser_is_told_busy_until_the_first_is_silent() -> None:
    """One browser feeds. The second hears what to do, and takes the seat when the first has gone."""
    with world() as made, made.browser() as first:
        until(lambda: bool(first.told("welcome")), "the welcome")
        with made.browser(device="d1", track="t1") as second:
            until(lambda: bool(second.told("refused")), "the refusal")
            assert "another browser" in second.told("refused")[0]["problem"]
            assert not second.told("welcome")
            first.leave()
            until(lambda: bool(second.told("welcome")), "the seat")


def test_a_camera_that_falls_silent_or_says_so_is_gone_until_it_is_back() -> None:
    """Images that stop coming are a stall; a track that ended or is muted is gone at once."""
    with world() as made, made.browser() as browser, made.camera() as camera:
        made.read(camera, lambda: len(made.frames) >= 5)
        browser.say(kind="track", live=True, muted=True, words="muted")
        made.read(camera, lambda: camera.health.state is CameraState.GONE)
        assert "muted" in made.feed.words
        browser.say(kind="track", live=True, muted=False, words="")
        made.read(camera, lambda: camera.health.state is CameraState.RUNNING)
        browser.is_still = True
        made.read(camera, lambda: camera.health.stalls == 1)
        browser.is_still = False
        made.read(camera, lambda: camera.health.returned == 2)


def test_a_host_that_is_slow_has_frames_dropped_in_the_browser() -> None:
    """Nothing piles up: without a reader at most the credit comes, the newest of it waits, and the rest is counted."""
    with world() as made, made.browser() as browser, made.camera() as camera:
        made.read(camera, lambda: len(made.frames) >= 3)
        before, dropped = browser.sent, browser.dropped
        until(lambda: browser.dropped >= dropped + 20, "drops")
        assert browser.sent - before <= 3
        made.read(camera, lambda: camera.health.missed >= 20)
        camera.pause()
        until(lambda: bool(browser.told("idle")), "rest")
        assert camera.health.state is CameraState.PAUSED
        camera.resume(now.monotonic_ns())
        before = len(made.frames)
        made.read(camera, lambda: len(made.frames) > before)


def test_what_lies_is_dropped_by_name() -> None:
    """A turned image, one of another size, one too many bytes and a late stamp are each counted; the user is told to turn it back."""
    lies: dict[int, Callable[[Shot], Shot]] = {
        10: lambda shot: replace(shot, rotation=90),
        14: lambda shot: replace(shot, width=31),
        18: lambda shot: replace(LUMA_SHOT, payload=bytes(5), stamp_us=shot.stamp_us, callback_us=shot.callback_us),
        22: lambda shot: replace(shot, stamp_us=shot.stamp_us - 12_000),
    }
    sent, is_lying = 0, False

    def spoil(shot: Shot) -> Shot:
        nonlocal sent
        sent += is_lying
        return lies[sent](shot) if sent in lies else shot

    with world() as made, made.browser(spoil=spoil) as browser, made.camera() as camera:
        is_lying = True
        made.read(camera, lambda: sent > 30 and len(camera.health.faults) >= len(lies))
        assert dict(camera.health.faults) == {
            FrameFault.TURNED: 1,
            FrameFault.OTHER_SIZE: 1,
            FrameFault.WRONG_LENGTH: 1,
            FrameFault.IMPLAUSIBLE_TIME: 1,
        }
        words = [said["words"] for said in browser.told("told")]
        assert "turned back" in words[-2]
        assert words[-1] == ""


def test_frames_beyond_the_credit_are_not_used_and_end_the_line() -> None:
    """A browser that sends on and on is sent away; its frames are counted by name."""
    with world() as made, made.browser() as browser, made.camera() as camera:
        made.read(camera, lambda: len(made.frames) >= 3)
        data = SHOTS[0].packed(2**31, 0, 1.0)
        with suppress(aiohttp.ClientConnectionResetError):  # the line may end before the refusal is read
            for _ in range(60):
                browser.send(data)
        until(lambda: bool(browser.told("refused")), "the refusal")
        made.read(camera, lambda: dict(camera.health.faults).get(FrameFault.UNASKED, 0) > 20)


def test_locks_are_set_read_back_and_set_again() -> None:
    """What is held is what the browser read back; a browser that comes back is told anew in its welcome."""
    locks = ((Lock.EXPOSURE, 10_000), (Lock.FOCUS, 350))
    with world() as made, made.browser() as browser, made.camera() as camera:
        holder = lockable(camera)
        assert holder is not None
        holder.hold(locks, now.monotonic_ns())
        assert held_locks(camera) == locks
        assert dict(camera.health.held) == {"exposure_us": 10_000, "focus": 350}
        browser.leave()
        made.read(camera, lambda: camera.health.state is CameraState.GONE)
        browser.come()
        until(lambda: len(browser.told("welcome")) == 2, "the welcome")
        assert browser.told("welcome")[1]["locks"]["groups"]["focus"]["focusDistance"] == 0.35


def test_the_wish_of_the_address_reaches_the_browser() -> None:
    """Size, rate and encoding are asked for, identity and description are what came."""
    with world() as made, made.browser(shots=[LUMA_SHOT]) as browser:
        until(lambda: bool(browser.told("welcome")), "the welcome")
        with made.camera("browser:?w=32&h=24&fps=30&encoding=luma") as camera:
            assert browser.told("want")[0] == {
                "kind": "want",
                "width": 32,
                "height": 24,
                "fps": 30.0,
                "encoding": "luma",
                "quality": None,
            }
            shown = camera.description
            assert (shown.width_px, shown.height_px, shown.pixel_format) == (32, 24, PixelFormat.GREY)
            assert shown.period_ns == pytest.approx(1e9 / 30, rel=0.01)
            assert (shown.identity.name, shown.identity.serial) == ("camera2 0, facing back", "d0")
            assert source_of(camera).software == "Chrome 156 on Linux"


@pytest.mark.parametrize(
    ("script", "uri", "said"),
    [
        (None, "browser:", "no browser gives its camera"),
        ({}, "browser:?w=64&h=48", "other_size"),
    ],
)
def test_a_camera_that_cannot_be_had_is_told_with_its_remedy(
    script: dict[str, Any] | None, uri: str, said: str
) -> None:
    """Nobody there, or images that cannot be used: one line, exit code 3."""
    with world(patience_ns=1_000_000_000) as made:
        there: AbstractContextManager[Any] = nullcontext() if script is None else made.browser(**script)
        with there, pytest.raises(UnavailableError, match=said) as caught:
            open_camera(uri, "host", now.monotonic_ns(), feed=made.feed)
        assert "\n" not in str(caught.value)


def lines_of(url: str, path: str, *said: str | bytes, headers: dict[str, str] | None = None) -> list[Any]:
    """Say something over a WebSocket; return what is answered until it is closed, and the code of its end."""

    async def talk() -> list[Any]:
        async with aiohttp.ClientSession(url) as client, client.ws_connect(path, headers=headers) as socket:
            for each in said:
                await (socket.send_str(each) if isinstance(each, str) else socket.send_bytes(each))
            heard: list[Any] = [json.loads(message.data) async for message in socket]
            return [*heard, socket.close_code]

    return asyncio.run(talk())


def test_strangers_do_not_feed() -> None:
    """Without the token, with a false session, without a word, with too large a word or from another site nothing is taken."""
    with world(limits=replace(LIMITS, hello_s=0.3, frame_bytes=1000)) as made:
        address = made.server.address
        hello = json.dumps({"kind": "hello", "version": 1, "token": "wrong"})
        refused, code = lines_of(address, "/ws/camera", hello)
        assert (refused["kind"], code) == ("refused", 1008)
        assert "token" in refused["problem"]
        right = json.dumps({"kind": "hello", "version": 9, "token": made.server.token})
        assert "reload" in lines_of(address, "/ws/camera", right)[0]["remedy"]
        assert lines_of(address, "/ws/camera/clock", json.dumps({"kind": "hello", "session": "x"})) == [1008]
        assert lines_of(address, "/ws/camera") == [1008]
        assert lines_of(address, "/ws/camera", b"bytes") == [1008]
        assert lines_of(address, "/ws/camera", b"x" * 2000)[-1] in {1008, 1009}
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            lines_of(address, "/ws/camera", headers={"Origin": "http://evil.example"})
        assert made.feed.words == ""


def test_a_page_without_a_feed_takes_no_camera() -> None:
    """The answer says how to start one."""
    server = PageServer(PageSource(), PageSettings(port=0))
    server.start()
    try:
        for path in ("/ws/camera", "/ws/camera/clock"):
            with pytest.raises(aiohttp.WSServerHandshakeError, match="404"):
                lines_of(server.address, path)
    finally:
        server.stop()


def numbered(images: int) -> list[Shot]:
    """Images that show their numbers."""
    coded = [cv2.imencode(".jpg", draw(number)) for number in range(images)]
    return [Shot(payload=np.asarray(data).tobytes(), width=WIDTH_PX, height=HEIGHT_PX) for _, data in coded]


def test_a_board_and_a_browser_are_paired(tmp_path: Path) -> None:
    """In a run with a page, each pair shows one moment, its time is known within the stated uncertainty, and the report tells the epoch."""
    images, fps, out = 200, 20, tmp_path / "out"
    film, link = write_film(tmp_path / "film", images), f"ipc://{tmp_path}/board"
    arguments = ["run", "--serve", "127.0.0.1:0", "--camera", "browser:", "--link", link, "--out", str(out)]
    with (
        board(["run", "--camera", f"replay:{film}?fps={fps}&loop=1", "--link", link], tmp_path),
        page([*arguments, "--save-every", "3", "--pairs", "60"], tmp_path) as (running, client),
        ScriptedBrowser(client.url, Script(shots=numbered(images), fps=fps)),
    ):
        assert running.wait() == 0, running.stderr
    numbers = saved_numbers(out)
    assert len(numbers) == 20
    assert [left for left, _ in numbers] == [right for _, right in numbers]
    assert all(abs(ledger["time_skew_ns"]) < 500_000_000 / fps for ledger in ledgers(out)), "half a period"
    camera = json.loads((out / "report.json").read_text())["host_frames"]["camera"]
    assert camera["stamps"]["epoch"] == "CLOCK_MONOTONIC"
    remembered = json.loads((out / "cameras.json").read_text())
    assert "camera2 0, facing back" in json.dumps(remembered)
    assert "its stamps count on CLOCK_MONOTONIC" in running.out.read_text()


def test_without_a_page_the_remedy_is_one_line(tmp_path: Path) -> None:
    """`run --camera browser:` says what to add, and ends with exit code 2; doctor says where it is checked."""
    with host(["run", "--camera", "browser:", "--link", "tcp://127.0.0.1:1"], tmp_path) as running:
        assert running.wait() == 2
    assert re.fullmatch(r"phone-host: [^\n]*add --serve[^\n]*\n", running.stderr)
    with host(["doctor", "--camera", "browser:"], tmp_path, "doctor") as doctor:
        doctor.wait()
    assert "phone-host serve" in doctor.out.read_text()
