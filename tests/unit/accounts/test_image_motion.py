"""Image motion: the shifts are known because the images were moved by exactly that."""

import cv2
import numpy as np
import pytest

from phone_host.accounts.image_motion import MotionMeter, fast_shift_px
from phone_host.model import Image

MS = 1_000_000


def texture(width_px: int = 640, height_px: int = 480, seed: int = 3) -> Image:
    """Smooth noise, larger than a view so that it can be moved without an edge."""
    noise = np.random.default_rng(seed).integers(0, 255, (height_px + 200, width_px + 200), dtype=np.uint8)
    return np.asarray(cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 3.0), None, 0, 255, cv2.NORM_MINMAX), np.uint8)  # type: ignore[call-overload]  # None: made by the call


def view(image: Image, x_px: int, y_px: int) -> Image:
    """A 640x480 view of a texture, moved."""
    return image[100 + y_px : 580 + y_px, 100 + x_px : 740 + x_px]


@pytest.mark.parametrize(("x_px", "y_px"), [(0, 0), (2, 0), (-6, 0), (0, 10), (12, -9), (30, 0)])
def test_a_moved_view_has_moved_by_just_that(x_px: int, y_px: int) -> None:
    """The length of the shift is measured within a third of a pixel, in any direction."""
    image = texture()
    assert fast_shift_px(view(image, 0, 0), view(image, x_px, y_px)) == pytest.approx(np.hypot(x_px, y_px), abs=0.35)


def test_an_object_before_a_still_background_counts() -> None:
    """If a quarter of the image moves, that quarter sets the value: its depth would be wrong."""
    behind, before = texture(), texture(seed=5)
    first, second = view(behind, 0, 0).copy(), view(behind, 0, 0).copy()
    first[120:360, 160:480] = view(before, 0, 0)[120:360, 160:480]
    second[120:360, 160:480] = view(before, 8, 0)[120:360, 160:480]
    assert fast_shift_px(first, second) == pytest.approx(8.0, abs=0.5)


def test_a_blank_wall_tells_nothing() -> None:
    """If there is nothing to follow, the answer is NaN, not 0."""
    blank = np.full((480, 640), 128, np.uint8)
    assert np.isnan(fast_shift_px(blank, blank))


def test_colour_and_noise_make_no_motion() -> None:
    """A still scene with camera noise gives less than 0.1 px: 3 px/s at 30 frames a second."""
    rng = np.random.default_rng(1)
    still = cv2.cvtColor(view(texture(), 0, 0), cv2.COLOR_GRAY2BGR)
    noisy = [np.clip(still + rng.normal(0, 3, still.shape), 0, 255).astype(np.uint8) for _ in range(2)]
    assert fast_shift_px(noisy[0], noisy[1]) < 0.1


def test_speed_is_shift_by_time_between_consecutive_frames() -> None:
    """4 px in 1/20 s are 80 px/s. There is at most one measurement in half a second. Frames far apart or out of order give none."""
    image, meter = texture(), MotionMeter()
    assert np.isnan(meter.px_s)
    for number in range(40):
        now_ns = number * 50 * MS
        meter.add(view(image, 4 * (number % 8), 0), now_ns, now_ns)
        if number % 8 == 7:
            meter.add(view(image, 0, 0), now_ns - MS, now_ns)  # an older frame: no measurement
    assert meter.px_s == pytest.approx(80.0, rel=0.1)
    assert meter.width_px == 640
    lone = MotionMeter()
    lone.add(view(image, 0, 0), 0, 0)
    lone.add(view(image, 9, 0), 10**9, 10**9)
    assert np.isnan(lone.px_s)


def test_nothing_is_measured_on_a_blank_wall() -> None:
    """Without a corner the speed stays unknown; so does it if the second image shows nothing of the first."""
    blank = np.full((120, 160), 128, np.uint8)
    assert np.isnan(fast_shift_px(blank, blank))
    chance = np.random.default_rng(1)
    other, another = (chance.integers(0, 256, (120, 160), dtype=np.uint8) for _ in range(2))
    assert np.isnan(fast_shift_px(other, another))


def test_a_moment_without_anything_to_follow_leaves_the_speed_as_it_was() -> None:
    """A hand before the lens gives no measurement: the earlier speed stays, and no NaN spoils the median."""
    image, blank = texture(), np.full((480, 640), 128, np.uint8)
    meter = MotionMeter()
    for number, shown in enumerate([view(image, 0, 0), view(image, 6, 0), blank, blank]):
        meter.add(shown, number * 100 * MS, number * 1000 * MS)
    assert meter.px_s == pytest.approx(60.0, rel=0.1)
