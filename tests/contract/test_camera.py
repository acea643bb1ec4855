"""What every camera must do. A new camera adds its openers to CAMERAS."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.camera.base import CameraState, Ended, Mode, Skipped
from common.frame import Frame, PixelFormat, find_fault
from common.protocol.message import Pacing, Steering
from tests.support.camera_sets import CLOCK, IMAGES, Set, browser, held, recorded, replay, served

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
    """Grabs are numbered from 0. A gap is as long as the frames that the camera says it has missed; on simulated time there is none."""
    grabs = [grab for grab in opened.take(2 * IMAGES) if not isinstance(grab, Ended)]
    expected = missed = 0
    for grab in grabs:
        assert grab.sequence >= expected
        missed += grab.sequence - expected
        expected = grab.sequence + (grab.frames if isinstance(grab, Skipped) else 1)
    assert missed <= opened.camera.health.missed
    assert opened.is_real or missed == 0
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
