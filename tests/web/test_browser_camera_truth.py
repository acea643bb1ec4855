"""A browser's camera from the sensor to the host: Chromium films a file with numbered images, and the file itself tells when each was read."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import pytest

from common import now
from common.frame import Frame, PixelFormat
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import StepName
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, draw, number_of
from tests.web.conftest import CHROMIUM, FLAGS, TOKEN
from tests.web.played import Played

SCALE: Final = 4
IMAGES: Final = 150
FRAMES: Final = 75
ROOT: Final = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of numbered images, 640x480 at 30 a second, as Chromium's fake camera reads them (YUV4MPEG2)."""
    width, height = WIDTH_PX * SCALE, HEIGHT_PX * SCALE
    path = tmp_path_factory.mktemp("film") / "numbered.y4m"
    with path.open("wb") as file:
        file.write(f"YUV4MPEG2 W{width} H{height} F30:1 Ip A1:1 C420jpeg\n".encode())
        for number in range(IMAGES):
            grey = cv2.resize(draw(number), (width, height), interpolation=cv2.INTER_NEAREST)
            file.write(b"FRAME\n" + grey.tobytes() + bytes([128]) * (width * height // 2))
    return path


@pytest.fixture
def reads(film: Path) -> Iterator[list[int]]:
    """When the film was read, CLOCK_MONOTONIC, ns; it grows."""
    watcher = subprocess.Popen(
        [sys.executable, "-m", "tests.support.file_reads", str(film)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert watcher.stdout is not None
    assert watcher.stdout.readline() == "ready\n"
    found: list[int] = []

    def listen(lines: Any) -> None:
        for line in lines:
            read_ns, count = map(int, line.split())
            found.extend([read_ns] * count)

    listener = threading.Thread(target=listen, args=(watcher.stdout,), daemon=True)
    listener.start()
    yield found
    watcher.kill()
    watcher.wait()
    listener.join()
    watcher.stdout.close()


def number_in(frame: Frame) -> int:
    """The number that an image shows."""
    pixels = np.frombuffer(frame.payload, np.uint8)
    if frame.pixel_format is PixelFormat.GREY:
        image = pixels.reshape(frame.height_px, frame.width_px)
    else:
        image = np.asarray(cv2.imdecode(pixels, cv2.IMREAD_GRAYSCALE), np.uint8)
    return number_of(np.ascontiguousarray(image[::SCALE, ::SCALE]))


@pytest.mark.parametrize(
    "way",
    [
        ("browser:?w=640&h=480&encoding=luma", "", "CLOCK_MONOTONIC"),
        ("browser:?w=640&h=480&encoding=jpeg", "delete window.MediaStreamTrackProcessor", "no clock of this machine"),
    ],
    ids=["processor", "fallback"],
)
def test_each_image_has_the_stamp_of_the_moment_at_which_it_was_taken(
    browser: Any, film: Path, reads: list[int], way: tuple[str, str, str]
) -> None:
    """Stamps advance at least as the images' numbers, are younger than a period on arrival, and typically within 3 ms of the file's reading."""
    uri, script, epoch = way
    feed = BrowserFeed(30_000_000_000)
    program = Played((), settings={"camera": "browser:"}, done={StepName.BOARD}, feed=feed)
    server = PageServer(program, PageSettings(port=0, token=TOKEN))
    server.start()
    flags = [*FLAGS, "--use-fake-ui-for-media-stream", f"--use-file-for-fake-video-capture={film}"]
    chromium = browser.browser_type.launch(executable_path=CHROMIUM, args=flags)
    try:
        page = chromium.new_page()
        if script:
            page.add_init_script(script)
        page.goto(server.url)
        page.evaluate("() => { location.hash = 'camera'; }")
        page.click("#own-go[data-running=no]")
        camera = open_camera(uri, "host", now.monotonic_ns(), feed=feed)
        frames: list[Frame] = []
        while len(frames) < FRAMES:
            page.wait_for_timeout(10)
            frames += [grab for grab in camera.read(now.monotonic_ns()) if isinstance(grab, Frame)]
        origin = camera.health.origin
        camera.close()
    finally:
        chromium.close()
        server.stop()
    assert origin is not None
    assert origin.epoch == epoch
    exposed_ns, read_ns = np.array([frame.exposed.ns for frame in frames]), np.array(reads)
    # Image by image, each in its period; a machine that is busy reads late and leaves no image out, so stamps may step farther.
    steps = np.diff([number_in(frame) for frame in frames]) % IMAGES
    assert np.mean(np.round(np.diff(exposed_ns) * 30e-9) >= steps) > 0.9
    # A stamp that belonged to another image would be a period off.
    assert 0 < np.median([frame.grabbed - frame.exposed for frame in frames]) < 33_000_000
    # Under load inotify reports some readings late, or two as one: the median does not mind.
    errors_ns = exposed_ns - read_ns[np.abs(exposed_ns[:, None] - read_ns).argmin(axis=1)]
    assert abs(np.median(errors_ns)) < 3_000_000
