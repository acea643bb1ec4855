"""Levels are measured on pixels that show the same thing, however much else the two views show."""

import cv2
import numpy as np
import pytest

from phone_host.model import Image
from phone_host.stereo.match_align import with_levels_of
from phone_host.stereo.match_differences import UNCHANGED, LevelField, levels_between, without_levels
from tests.support.planes import noise, plane

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
    assert abs(with_levels_of(left, right).astype(float).mean() - right.mean()) > 20
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


@pytest.mark.parametrize(("gain", "offset"), [(1.0, 0), (0.7, 20), (1.25, -20)])
@pytest.mark.parametrize("near_px", [20.0, 20.3, 20.5])
def test_a_fine_texture_between_pixels_has_the_gain_that_it_was_given(
    gain: float, offset: float, near_px: float
) -> None:
    """Texture of 4 px, seen at any fraction of a pixel, with noise of 2 levels on both sides, gives the gain within 1 %."""
    scene = plane(near_px=near_px, slope_x=0, slope_y=0)
    random = np.random.default_rng(4)
    left = np.clip(np.rint(scene.pair.left + random.normal(0, 2, scene.pair.left.shape)), 0, 255).astype(np.uint8)
    changed = scene.pair.right * gain + offset + random.normal(0, 2, left.shape)
    right = np.clip(np.rint(changed), 0, 255).astype(np.uint8)
    found = levels_between(left, right, scene.disparity_px.astype(np.float32))
    assert found.gain == pytest.approx(1 / gain, rel=0.01)
    assert found.offset_levels == pytest.approx(-offset / gain, abs=2)
    assert found.vignetting_percent == pytest.approx(0, abs=2)


def _darkened(image: Image, gain: float, vignetting: float) -> Image:
    """The image with levels that gain * (1 + vignetting * (x^2 + y^2) / 2) brings back, x and y from -1 to 1."""
    height, width = image.shape
    x, y = np.linspace(-1, 1, width), np.linspace(-1, 1, height)[:, np.newaxis]
    return np.asarray(np.rint(image / (gain * (1 + vignetting * (x**2 + y**2) / 2))), np.uint8)


@pytest.mark.parametrize("vignetting", [0.15, 0.3])
@pytest.mark.parametrize("gain", [1.0, 1.3])
def test_vignetting_is_measured_though_walls_are_plain_and_views_differ(vignetting: float, gain: float) -> None:
    """A third of plain wall, a door in one view only and noise change the gain by at most 2 %, the corners' by a tenth of theirs."""
    left, right = _unlike_views()
    left[:70], right[:70] = 150, 150
    noisy = np.random.default_rng(4).normal(0, 1.5, (2, *left.shape))
    dark = _darkened(right, gain, vignetting) + noisy[1]
    found = levels_between(
        np.rint(np.clip(left + noisy[0], 0, 255)).astype(np.uint8),
        np.rint(np.clip(dark, 0, 255)).astype(np.uint8),
        _known(left),
    )
    assert found.gain == pytest.approx(gain, rel=0.02)
    assert found.vignetting_percent == pytest.approx(100 * vignetting, rel=0.1)
    assert found.shading_percent <= 6


def test_a_lamp_from_one_side_is_told_as_shading() -> None:
    """A gain that rises by 24 % of that of the middle from the left edge to the right one is told so, within 3 %; corners by none."""
    left, right = _unlike_views()
    dark = np.rint(right / (1 + 0.12 * np.linspace(-1, 1, 300))).astype(np.uint8)
    found = levels_between(left, dark, _known(left))
    assert found.shading_percent == pytest.approx(24, abs=3)
    assert found.vignetting_percent == pytest.approx(0, abs=3)


def test_the_gain_of_each_pixel_is_applied() -> None:
    """Corners, middle and edge get gain * (1 + change) * level + offset, and no change beyond 40 %."""
    field = LevelField(gain=1.2, offset_levels=5, field=(0.1, 0, 0.2, 0, 0.2))
    image = np.full((101, 201), 100, np.uint8)
    evened = field.of(image)
    assert (evened[50, 100], evened[0, 0], evened[50, 200]) == (125, 161, 161)  # 1, 1.3 and 1.3 times 120, and 5
    assert evened[100, 200] == 173  # 1.5 times is cut to 1.4
    assert field.vignetting_percent == pytest.approx(25 * (0.3 + 0.3 + 0.4 + 0.4))
    assert field.shading_percent == pytest.approx(20)


def test_levels_that_no_exposure_explains_are_left_alone() -> None:
    """A texture of 3 levels beside one of 100 is no matter of gain."""
    left = np.rint(_texture(300, 200)).astype(np.uint8)
    right = np.rint(128 + (left.astype(float) - 120) / 25).astype(np.uint8)
    assert levels_between(left, right, np.zeros(left.shape, np.float32)) == UNCHANGED
