"""What a replay of files promises beyond what every camera must do."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.camera.base import Ended, Mode, Spoiled
from common.errors import DataError, TandemError, UnavailableError
from common.frame import Frame, FrameFault, PixelFormat
from phone_host.camera.factory import open_camera
from tests.support.camera_sets import CLOCK, IMAGES, START_NS, Set, fill
from tests.support.pictures import encoded, jpeg, picture


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
