"""What every camera must do. A new camera adds its openers to CAMERAS. After that: what a replay promises beyond it."""

import select
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from common import now
from common.camera.base import Camera, CameraState, Ended, Grab, Mode, Skipped, Spoiled
from common.camera.factory import CameraRequest
from common.errors import DataError, TandemError, UnavailableError
from common.frame import Frame, FrameFault, PixelFormat, find_fault
from common.protocol.message import Pacing, Steering
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


CAMERAS: dict[str, Callable[[Path], Set]] = {
    "replay clock loop": replay("fps=30&loop=1"),
    "replay clock": replay("fps=30"),
    "replay demand loop": replay("fps=30&loop=1&pace=demand"),
    "replay demand": replay("fps=24&pace=demand"),
    "replay of a turned camera": replay("fps=30&loop=1&rotate=90&flip=h"),
    "recording clock": recorded("pace=clock"),
    "recording clock loop": recorded("pace=clock&loop=1"),
    "recording demand": recorded("pace=demand"),
    "mjpeg over http": served,
    "painted by another package": held,
    "browser, jpeg": browser("jpeg"),
    "browser, luma": browser("luma"),
}


@pytest.fixture(params=CAMERAS)
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Set]:
    """Each kind of camera, open."""
    made = CAMERAS[request.param](tmp_path / "images")
    yield made
    made.camera.close()
    made.ending.close()
    if made.server is not None:
        made.server.stop()


def test_description_fits_the_frames(opened: Set) -> None:
    """Each frame has the size and encoding of the description, and its bytes are a whole image of that size."""
    description = opened.camera.description
    assert description.period_ns > 0
    for grab in opened.take(IMAGES):
        if isinstance(grab, Frame):
            assert (grab.width_px, grab.height_px) == (description.width_px, description.height_px)
            assert grab.pixel_format is description.pixel_format
            assert find_fault(grab.pixel_format, grab.payload) is None
            if grab.pixel_format is PixelFormat.GREY:
                assert len(grab.payload) == description.height_px * description.width_px
                continue
            image = cv2.imdecode(np.frombuffer(grab.payload, np.uint8), cv2.IMREAD_UNCHANGED)
            assert image is not None
            assert image.shape[:2] == (description.height_px, description.width_px)


def test_sequence_counts_every_grab(opened: Set) -> None:
    """Grabs are numbered from 0 without a gap as long as they are read in time."""
    grabs = [grab for grab in opened.take(2 * IMAGES) if not isinstance(grab, Ended)]
    expected = 0
    for grab in grabs:
        assert grab.sequence == expected
        expected += grab.frames if isinstance(grab, Skipped) else 1
    assert len(grabs) >= IMAGES


def test_stamps_rise_and_are_on_the_named_clock(opened: Set) -> None:
    """Exposures strictly increase, a frame is grabbed when it is read, and both stamps are on the machine's clock."""
    frames = [grab for grab in opened.take(2 * IMAGES) if isinstance(grab, Frame)]
    for before, after in pairwise(frames):
        assert before.exposed < after.exposed
        assert before.grabbed <= after.grabbed
    assert {frame.exposed.clock for frame in frames} == {frame.grabbed.clock for frame in frames} == {CLOCK}
    if opened.camera.description.pacing is Pacing.CLOCK:
        assert all(frame.exposed <= frame.grabbed for frame in frames)


def test_reading_never_waits_nor_repeats(opened: Set) -> None:
    """A clock-paced camera returns nothing early and nothing twice; one on demand returns one grab per read."""
    if opened.camera.description.pacing is Pacing.DEMAND:
        assert [len(opened.next()) for _ in range(IMAGES)] == [1] * IMAGES
        return
    if opened.is_real:
        pytest.skip("its images come when they come")
    assert opened.camera.read(opened.now_ns) == []
    due_ns = opened.camera.due_ns(opened.now_ns)
    assert due_ns > opened.now_ns
    assert opened.camera.read(due_ns - 1) == []
    assert len(opened.camera.read(due_ns)) == 1
    assert opened.camera.read(due_ns) == []


def test_frames_follow_each_other_at_the_stated_period(opened: Set) -> None:
    """The mean distance of exposures is the period in the description, to the nanosecond of rounding."""
    if opened.is_real:
        pytest.skip("its stamps are arrivals")
    frames = [grab for grab in opened.take(IMAGES) if isinstance(grab, Frame)]
    span_ns = frames[-1].exposed - frames[0].exposed
    assert abs(span_ns - (len(frames) - 1) * opened.camera.description.period_ns) <= len(frames)


def test_every_mode_that_is_offered_can_be_had_and_left(opened: Set) -> None:
    """The first mode on offer is the current one. After a change, frames and description follow and numbering goes on; changing back restores the first mode."""
    camera = opened.camera
    first = camera.description
    opened.take(1)
    if not camera.offers.periods_ns:
        camera.adapt(Mode(10 * first.period_ns, 1), opened.now_ns)
        assert camera.description == first
        assert any(isinstance(grab, Frame) for grab in opened.take(2))
        return
    assert camera.offers.periods_ns[0] == first.period_ns
    assert list(camera.offers.periods_ns) == sorted(set(camera.offers.periods_ns))
    assert list(camera.offers.qualities) == sorted(set(camera.offers.qualities), reverse=True)
    qualities = camera.offers.qualities or (0,)
    modes = [
        *(Mode(period, qualities[0]) for period in camera.offers.periods_ns[:3]),
        Mode(first.period_ns, qualities[-1]),
    ]
    frames: list[Frame] = []
    for mode in [*modes, Mode(first.period_ns, qualities[0])]:
        camera.adapt(mode, opened.now_ns)
        assert camera.description.period_ns == mode.period_ns
        taken = [grab for grab in opened.take(3) if isinstance(grab, Frame)]
        for before, after in pairwise(taken):
            assert after.sequence == before.sequence + 1
            if not opened.is_real:
                assert abs(after.exposed - before.exposed - mode.period_ns) <= 2
        frames += taken
    assert camera.description == first
    assert all(before.exposed < after.exposed for before, after in pairwise(frames))


def test_a_rest_is_harmless(opened: Set) -> None:
    """Told twice that nobody listens and twice that somebody does, a camera keeps running and says so."""
    opened.take(1)
    for _ in range(2):
        opened.camera.pause()
    for _ in range(2):
        opened.camera.resume(opened.now_ns)
    assert any(isinstance(grab, Frame) for grab in opened.take(1))
    assert opened.camera.health.state is CameraState.RUNNING


# What only a replay promises.


def test_on_the_clock_image_k_is_exposed_at_k_over_fps(tmp_path: Path) -> None:
    """On CLOCK_MONOTONIC, image k is exposed exactly at k / fps and shows file k modulo the number of files."""
    contents = fill(tmp_path)
    camera = open_camera(f"replay:{tmp_path}?fps=30&loop=1", CLOCK, START_NS)
    frames = camera.read(START_NS + 1_000_000_000)
    first = START_NS * 30 // 10**9 + 1
    assert len(frames) == 30
    for k, frame in enumerate(frames, start=first):
        assert isinstance(frame, Frame)
        assert frame.exposed.ns == round(k * 10**9 / 30)
        assert frame.payload == contents[k % IMAGES]


@pytest.mark.parametrize("rung", range(10))
def test_a_slower_replay_still_agrees_with_a_fast_one(tmp_path: Path, rung: int) -> None:
    """Slowed down at any moment, a replay shows images of the original grid at even distances, each with the stamp and bytes it has there."""
    fill(tmp_path)
    slow, fast = (open_camera(f"replay:{tmp_path}?fps=25&loop=1", CLOCK, START_NS) for _ in range(2))
    then_ns = START_NS + 1_000_000_000
    slow.read(then_ns)
    slow.adapt(Mode(slow.offers.periods_ns[rung]), then_ns)
    end_ns = then_ns + 10_000_000_000
    fast.read(then_ns)
    grid: dict[int, bytes] = {}
    while (due_ns := fast.due_ns(0)) <= end_ns:
        grid |= {grab.exposed.ns: bytes(grab.payload) for grab in fast.read(due_ns) if isinstance(grab, Frame)}
    shown: list[Frame] = []
    while (due_ns := slow.due_ns(0)) <= end_ns:
        shown += [grab for grab in slow.read(due_ns) if isinstance(grab, Frame)]
    assert all(grid[frame.exposed.ns] == frame.payload for frame in shown)
    assert len(shown) == pytest.approx(10e9 / slow.description.period_ns, abs=1)
    assert {after.exposed - before.exposed for before, after in pairwise(shown)} == {slow.description.period_ns}


@pytest.mark.parametrize("later_ns", [1, 33_333_333, 1_234_567_891, 3600 * 10**9])
def test_two_replays_agree_whenever_they_were_started(tmp_path: Path, later_ns: int) -> None:
    """Two replays on one machine show the same number with the same stamp at the same moment."""
    fill(tmp_path / "a")
    fill(tmp_path / "b")
    early = open_camera(f"replay:{tmp_path}/a?fps=25&loop=1", CLOCK, START_NS)
    late = open_camera(f"replay:{tmp_path}/b?fps=25&loop=1", CLOCK, START_NS + later_ns)
    then_ns = START_NS + later_ns
    early.read(then_ns)
    ours, theirs = (camera.read(then_ns + 400_000_000) for camera in (early, late))
    assert len(ours) == len(theirs) == 10
    for one, other in zip(ours, theirs, strict=True):
        assert isinstance(one, Frame)
        assert isinstance(other, Frame)
        assert (one.exposed, one.payload) == (other.exposed, other.payload)


def test_without_loop_every_image_is_shown_once_then_it_ends(tmp_path: Path) -> None:
    """On the clock and on demand: files come in name order, each once, then Ended on every read."""
    contents = fill(tmp_path, images=11)
    for pace in ("clock", "demand"):
        opened = Set(open_camera(f"replay:{tmp_path}?pace={pace}", CLOCK, START_NS), START_NS)
        grabs = opened.take(100)
        assert [grab.payload for grab in grabs if isinstance(grab, Frame)] == contents
        assert isinstance(grabs[-1], Ended)
        assert opened.camera.read(opened.now_ns + 10**9)[-1:] == [Ended()]


def test_on_demand_stamps_are_first_plus_k_over_fps(tmp_path: Path) -> None:
    """However irregular the demand, stamps are the time of the first read (or the anchor) + k / fps; with loop the film repeats."""
    contents = fill(tmp_path)
    for anchor_ns in (None, 777):
        camera = open_camera(f"replay:{tmp_path}?fps=24&pace=demand&loop=1", CLOCK, START_NS)
        if anchor_ns is not None:
            camera.anchor(anchor_ns + 5, 3)
            camera.anchor(anchor_ns, 0)  # the last one counts
        first_ns = START_NS + 5 if anchor_ns is None else anchor_ns
        for k in range(2 * IMAGES):
            [frame] = camera.read(START_NS + 5 + k * k * 10**8)
            assert isinstance(frame, Frame)
            assert frame.exposed.ns == first_ns + round(k * 10**9 / 24)
            assert frame.payload == contents[k % IMAGES]


@pytest.mark.parametrize("options", ["fps=30", "pace=demand"])
def test_a_truncated_jpeg_is_a_spoiled_grab(tmp_path: Path, options: str) -> None:
    """A truncated file arrives as Spoiled under its own number; the frames around it are unaffected."""
    contents = fill(tmp_path)
    (tmp_path / "frame3.jpg").write_bytes(contents[2][:-100])
    opened = Set(open_camera(f"replay:{tmp_path}?{options}", CLOCK, START_NS), START_NS)
    grabs = opened.take(IMAGES)
    assert grabs[2] == Spoiled(2, FrameFault.NO_END)
    frames = [grab for grab in grabs if isinstance(grab, Frame)]
    assert [frame.sequence for frame in frames] == [0, 1, 3, 4]
    assert frames[2].exposed - frames[1].exposed == pytest.approx(2 * opened.camera.description.period_ns, abs=2)


@pytest.mark.parametrize("suffix", [".pgm", ".ppm", ".png"])
def test_other_images_are_sent_without_loss(tmp_path: Path, suffix: str) -> None:
    """PGM, PPM and PNG files arrive as PNG with exactly the same pixels."""
    image = picture(40, 30)
    pixels = image[..., 0] if suffix == ".pgm" else image
    (tmp_path / f"a{suffix}").write_bytes(encoded(suffix, np.ascontiguousarray(pixels)))
    camera = open_camera(f"replay:{tmp_path}?pace=demand", CLOCK, START_NS)
    [frame] = camera.read(START_NS)
    assert isinstance(frame, Frame)
    assert frame.pixel_format is PixelFormat.PNG
    decoded = cv2.imdecode(np.frombuffer(frame.payload, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    np.testing.assert_array_equal(decoded, pixels)


def spoil_nothing(folder: Path) -> None:
    """A folder without images."""
    for path in folder.iterdir():
        path.unlink()


def test_steering_moves_the_grid_of_exposures(opened: Set) -> None:
    """A camera whose grid can be moved exposes later by exactly the given time from then on; any other camera ignores the request."""
    if opened.is_real:
        pytest.skip("its stamps are arrivals")
    period_ns = opened.camera.description.period_ns
    before = [grab for grab in opened.take(2) if isinstance(grab, Frame)]
    opened.camera.steer(period_ns // 3, opened.now_ns)
    after = next(grab for grab in opened.take(1) if isinstance(grab, Frame))
    asked_ns = period_ns // 3 if opened.camera.description.steering is Steering.GRID else 0
    moved_ns = (after.exposed.ns - before[-1].exposed.ns - asked_ns) % period_ns
    assert min(moved_ns, period_ns - moved_ns) <= 2


def spoil_size(folder: Path) -> None:
    """One image differs in size."""
    (folder / "frame4.jpg").write_bytes(jpeg(48, 24))


def spoil_kind(folder: Path) -> None:
    """One image differs in encoding."""
    (folder / "frame4.jpg").write_bytes(encoded(".png", picture()))


def spoil_text(folder: Path) -> None:
    """One file is no image."""
    (folder / "frame4.jpg").write_text("not an image")


def spoil_folder(folder: Path) -> None:
    """A folder is named like an image."""
    (folder / "frame4.jpg").unlink()
    (folder / "frame4.jpg").mkdir()


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (spoil_nothing, "images"),
        (spoil_size, "frame4.jpg is 48x24"),
        (spoil_kind, "frame4.jpg is png"),
        (spoil_text, "frame4.jpg"),
        (spoil_folder, "frame4.jpg"),
    ],
)
def test_a_bad_folder_is_refused_by_name(tmp_path: Path, spoil: Callable[[Path], None], named: str) -> None:
    """A replay without images, with unlike images or with other files is bad data; the message is one line with the file's name."""
    folder = tmp_path / "images"
    fill(folder)
    spoil(folder)
    with pytest.raises(DataError) as caught:
        open_camera(f"replay:{folder}", CLOCK, START_NS)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_folder_is_unavailable(tmp_path: Path) -> None:
    """A missing folder may still appear: exit code 3, with its name."""
    with pytest.raises(UnavailableError, match="nowhere") as caught:
        open_camera(f"replay:{tmp_path}/nowhere", CLOCK, START_NS)
    assert caught.value.exit_code == 3


def test_files_that_vanish_later_are_told(tmp_path: Path) -> None:
    """If the files of a film too long for memory disappear, it ends with an error that names the file, not with a crash."""
    big = jpeg() + bytes(200)
    for i in range(3):
        (tmp_path / f"{i}.jpg").write_bytes(big)
    camera = open_camera(f"replay:{tmp_path}?pace=demand&loop=1", CLOCK, START_NS)
    camera.close()  # drops what is cached in memory
    (tmp_path / "0.jpg").unlink()
    with pytest.raises(TandemError, match=r"0\.jpg"):
        camera.read(START_NS)
