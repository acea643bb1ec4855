"""Cameras of all kinds, open, on simulated time where they can be: for the tests of what every camera must do."""

import select
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from common import now
from common.camera.base import Camera, Ended, Grab
from common.camera.factory import CameraRequest
from common.protocol.message import Pacing
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from tests.support.mjpeg_server import MjpegServer
from tests.support.novice.camera import PLAN, NoviceCamera
from tests.support.novice.hands import write_plan
from tests.support.novice.head import Novice
from tests.support.page_source import PageSource
from tests.support.pictures import encoded, jpeg, picture
from tests.support.recorded import recording_file
from tests.support.scripted_browser import LUMA, Script, ScriptedBrowser, Shot

CLOCK = "board:test"
START_NS = 5_000_000_007
IMAGES = 5


@dataclass(slots=True)
class Set:
    """A camera on simulated time.

    Attributes:
        camera: an open camera.
        now_ns: the current time.
        server: the server of its images, if any.
    """

    camera: Camera
    now_ns: int
    server: MjpegServer | None = None
    ending: ExitStack = field(default_factory=ExitStack)

    @property
    def is_real(self) -> bool:
        """Whether it runs in real time instead of simulated time."""
        return self.camera.pollable is not None

    def next(self) -> list[Grab]:
        """Advance time until the camera has something, and read it."""
        if self.camera.pollable is not None:
            assert select.select([self.camera.pollable], [], [], 60)[0]
            self.now_ns = now.monotonic_ns()
        elif self.camera.description.pacing is Pacing.DEMAND:
            self.now_ns += 1_000_000
        else:
            self.now_ns = max(self.now_ns, self.camera.due_ns(self.now_ns))
        return self.camera.read(self.now_ns)

    def take(self, count: int) -> list[Grab]:
        """Read at least this many grabs, or all up to the end."""
        grabs: list[Grab] = []
        while len(grabs) < count and not (grabs and isinstance(grabs[-1], Ended)):
            grabs += self.next()
        return grabs


def fill(folder: Path, images: int = IMAGES) -> list[bytes]:
    """Write JPEGs frame1.jpg ... to a folder; return their bytes in name order."""
    folder.mkdir(exist_ok=True)
    contents = [jpeg(seed=i) for i in range(images)]
    for i, content in enumerate(contents):
        (folder / f"frame{i + 1}.jpg").write_bytes(content)
    return contents


def replay(options: str) -> Callable[[Path], Set]:
    """Open a replay of five JPEGs."""

    def opened(folder: Path) -> Set:
        fill(folder)
        return Set(open_camera(f"replay:{folder}?{options}", CLOCK, START_NS), START_NS)

    return opened


def served(folder: Path) -> Set:
    """Open a server of five JPEGs."""
    fill(folder)
    server = MjpegServer(folder, 30, "early_boundary")
    return Set(open_camera(server.uri, CLOCK, now.monotonic_ns()), now.monotonic_ns(), server)


def browser(encoding: str) -> Callable[[Path], Set]:
    """Open the camera of a browser that sends JPEG images, or their luma."""

    def opened(_folder: Path) -> Set:
        feed = BrowserFeed(20_000_000_000)
        source = PageSource()
        source.feed = feed
        server = PageServer(source, PageSettings(port=0))
        server.start()
        ending = ExitStack()
        ending.callback(server.stop)
        ending.enter_context(ScriptedBrowser(server.url, Script(shots=shots(encoding))))
        opened = open_camera(f"browser:?encoding={encoding}", CLOCK, now.monotonic_ns(), feed=feed)
        return Set(opened, now.monotonic_ns(), ending=ending)

    return opened


def shots(encoding: str) -> list[Shot]:
    """Some images as a browser sends them."""
    grey = [np.ascontiguousarray(picture(seed=i)[..., 1]) for i in range(IMAGES)]
    height, width = grey[0].shape
    if encoding == "luma":
        return [Shot(payload=image.tobytes(), width=width, height=height, encoding=LUMA) for image in grey]
    return [Shot(payload=encoded(".jpg", image), width=width, height=height) for image in grey]


def held(folder: Path) -> Set:
    """Open another package's camera before which somebody holds a board."""
    folder.mkdir()
    write_plan(folder / PLAN, Novice(np.random.default_rng(1), np.zeros(3), 0.0).plan)
    options = (("side", "left"), ("seed", "1"), ("fps", "30"))
    request = CameraRequest(uri="novice:", path=str(folder), options=options, clock=CLOCK, now_ns=now.monotonic_ns())
    return Set(NoviceCamera(request), now.monotonic_ns())


def recorded(options: str) -> Callable[[Path], Set]:
    """A recording, opened with these options."""

    def made(folder: Path) -> Set:
        folder.mkdir()
        path = recording_file(folder, IMAGES)
        uri = f"replay:{path}?topic=/left/image/compressed&{options}"
        return Set(open_camera(uri, CLOCK, START_NS), START_NS)

    return made
