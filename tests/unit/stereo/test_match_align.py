"""Levels and vertical position of the right image are measured where possible, and otherwise left alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.model import Image
from phone_host.stereo.match_align import moved_up, vertical_offset_px, with_levels_of
from tests.support.planes import noise, plane


def dimmed(image: Image, gain: float, offset: float) -> Image:
    return np.asarray(np.clip(np.rint(image * gain + offset), 0, 255), np.uint8)


PLANE = plane().pair.left


@settings(deadline=None, max_examples=20)
@given(gain=st.floats(0.5, 1.2), offset=st.floats(0, 25))
def test_a_change_of_exposure_is_taken_back(gain: float, offset: float) -> None:
    """A gain and an offset are undone up to the rounding of the dimmed levels, except at clipped pixels."""
    image = np.clip(PLANE, 20, 190)
    back = with_levels_of(image, dimmed(image, gain, offset))
    # Rounding to whole levels before the gain is undone: half a level, divided by the gain; and half a level after it.
    assert np.abs(back.astype(float) - image).max() <= 0.5 / gain + 0.5 + 0.5


def test_black_borders_do_not_count() -> None:
    """Pixels that rectification left black in one image do not change the measured levels."""
    image = np.clip(plane().pair.left, 20, 250)
    left, right = image.copy(), dimmed(image, 0.7, 20)
    right[:, :60] = 0
    left[:20] = 0
    back = with_levels_of(left, right)
    assert np.abs(back[20:, 60:].astype(float) - image[20:, 60:]).max() <= 2


@pytest.mark.parametrize("flat", [0, 90, 255])
def test_levels_of_a_flat_image_are_left_alone(flat: int) -> None:
    """An image without contrast says nothing about exposure."""
    level = np.full((30, 40), flat, np.uint8)
    textured = noise(40, 30)
    assert (with_levels_of(level, textured) == textured).all()
    assert (with_levels_of(textured, level) == level).all()


@pytest.mark.parametrize("vertical_px", [-1.2, -0.5, 0.0, 0.25, 0.5, 1.0])
def test_vertical_offset_is_measured(vertical_px: float) -> None:
    """On a rendered plane whose disparity is known to half a pixel the offset is correct within 0.05 px."""
    scene = plane(vertical_px=vertical_px, shortest_px=8)
    rough = (scene.disparity_px + 0.5 * np.sin(np.arange(320) / 20)).astype(np.float32)
    assert vertical_offset_px(scene.pair.left, scene.pair.right, rough) == pytest.approx(vertical_px, abs=0.05)


def test_a_pair_without_vertical_detail_is_left_alone() -> None:
    """Vertical stripes look the same at every height: no offset can be measured, so none is reported."""
    stripes = np.repeat(noise(200, 1), 100, axis=0)
    assert vertical_offset_px(stripes, stripes, np.zeros((100, 200), np.float32)) == 0.0


def test_without_disparities_there_is_no_evidence() -> None:
    """If nothing was matched, nothing is measured."""
    image = plane().pair.left
    assert vertical_offset_px(image, moved_up(image, 0.5), np.full(image.shape, np.nan, np.float32)) == 0.0


def test_unrelated_images_give_no_direction() -> None:
    """Contradictory evidence gives no offset."""
    assert vertical_offset_px(noise(200, 150, 1), noise(200, 150, 2), np.zeros((150, 200), np.float32)) == 0.0


def test_moving_up_by_whole_rows_is_exact() -> None:
    """Moved up by 2 px, row y shows what stood at row y + 2; the last rows are continued."""
    image = noise(20, 10)
    moved = moved_up(image, 2.0)
    assert (moved[:8] == image[2:]).all()
    assert (moved[8:] == image[9]).all()
