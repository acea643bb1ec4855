"""Levels are measured on pixels that show the same thing, however much else the two views show."""

import cv2
import numpy as np
import pytest

from phone_host.model import Image
from phone_host.stereo.match_align import overall_levels
from phone_host.stereo.match_levels import UNCHANGED, levels_between, without_levels
from tests.support.planes import noise

SHIFT_PX = 60


def _texture(width_px: int, height_px: int) -> Image:
    """Smooth texture of 60 to 180 grey levels."""
    blurred = np.asarray(cv2.GaussianBlur(noise(width_px, height_px, seed=3).astype(np.float32), (0, 0), 3))
    return np.asarray(np.interp(blurred, (blurred.min(), blurred.max()), (60, 180)), np.uint8)


def _unlike_views() -> tuple[Image, Image]:
    """Two views of a plane 60 px apart; beside it the left one shows a white door, the right one a dark curtain."""
    wide = _texture(300 + SHIFT_PX, 200)
    left, right = wide[:, :300].copy(), wide[:, SHIFT_PX:].copy()
    left[:, :SHIFT_PX] = 245
    right[:, -SHIFT_PX:] = 10
    return left, right


def _known(image: Image) -> np.ndarray:
    disparity = np.full(image.shape, SHIFT_PX, np.float32)
    disparity[:, : SHIFT_PX + 4] = np.nan
    return disparity


def test_what_only_one_camera_sees_does_not_change_the_levels() -> None:
    """Two cameras of equal levels keep them within 1 %, though mean and deviation of the whole images say otherwise."""
    left, right = _unlike_views()
    assert abs(overall_levels(left, right).of(right).astype(float).mean() - right.mean()) > 20
    levels = levels_between(left, right, _known(left))
    assert levels.gain == pytest.approx(1, abs=0.01)
    assert levels.offset_levels == pytest.approx(0, abs=1.5)


@pytest.mark.parametrize(("gain", "offset"), [(0.7, 20), (0.5, 0), (1.2, -15)])
def test_exposure_is_found_though_a_third_of_the_matches_is_wrong(gain: float, offset: float) -> None:
    """A change of gain * level + offset is undone within 3 % and 3 levels, with a third of the disparities 25 px off."""
    left, right = _unlike_views()
    disparity = _known(left)
    disparity[::3] -= 25
    changed = np.clip(np.rint(right * gain + offset), 0, 255).astype(np.uint8)
    found = levels_between(left, changed, disparity)
    assert found.gain == pytest.approx(1 / gain, rel=0.03)
    assert np.median(np.abs(found.of(changed)[:, :240].astype(float) - right[:, :240])) <= 3


def test_a_lamp_from_one_side_is_evened_out() -> None:
    """A right image that darkens by 30 % from left to right gets the left one's levels, within two levels on both sides."""
    left, right = _unlike_views()
    shade = np.linspace(1.1, 0.8, 300, dtype=np.float32)
    dark = np.rint(right * shade).astype(np.uint8)
    evened = levels_between(left, dark, _known(left)).of(dark).astype(float)
    for part in (slice(0, 80), slice(160, 240)):
        assert np.median(np.abs(evened[:, part] - right[:, part])) <= 2


def test_without_matches_or_contrast_nothing_changes() -> None:
    """No disparity, or a plain wall, says nothing about levels."""
    left, right = _unlike_views()
    assert levels_between(left, right, np.full(left.shape, np.nan, np.float32)) == UNCHANGED
    plain = np.full(left.shape, 90, np.uint8)
    assert levels_between(plain, plain, np.zeros(left.shape, np.float32)) == UNCHANGED
    assert UNCHANGED.of(left) is left


def test_images_without_levels_are_alike_whatever_the_exposure() -> None:
    """Half the brightness and 20 levels more leave an image without its levels half as strong, around the same grey."""
    texture = _texture(120, 80)
    bright = without_levels(texture).astype(float) - 128
    dim = without_levels(np.rint(texture * 0.5 + 20).astype(np.uint8)).astype(float) - 128
    assert np.abs(dim - bright / 2).max() <= 2
