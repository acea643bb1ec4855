"""A browser's camera from the sensor to the host: Chromium films a file with numbered images, and the file itself tells when each was read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from common import now
from common.frame import Frame
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import StepName
from tests.support.numbered_film import against_reads, number_in, reads_of, write_numbered
from tests.web.conftest import CHROMIUM, FLAGS, TOKEN
from tests.web.played import Played

FRAMES: Final = 75


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of numbered images."""
    return write_numbered(tmp_path_factory.mktemp("film") / "numbered.y4m")


@pytest.fixture
def reads(film: Path) -> Iterator[list[int]]:
    """When the film was read, CLOCK_MONOTONIC, ns; it grows."""
    with reads_of(film) as found:
        yield found


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
    """A stamp is nearer to its own image's reading than to any other's, and images arrive after they were taken."""
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
    numbers, exposed_ns = (np.array(each) for each in zip(*((number_in(frame), frame.exposed.ns) for frame in frames), strict=True))  # fmt: skip
    right, _ = against_reads(numbers, exposed_ns, np.array(reads))
    # A machine that is busy reads a film late now and then. How exact stamps are on an idle one, bench_browser tells.
    assert np.mean(right) > 0.9
    assert np.median([frame.grabbed - frame.exposed for frame in frames]) > 0
