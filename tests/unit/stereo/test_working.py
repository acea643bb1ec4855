"""The images that are matched: when they are reduced, and what comes back at full size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phone_host.model import Crop, Epipolar, RectifiedPair
from phone_host.stereo.working import (
    MOST_PIXELS,
    MOST_STEPS,
    chosen_scale,
    confidence_of_known,
    lying,
    part_for,
    reduced,
    to_full_size,
    upright_again,
)
from tests.support.planes import noise


@pytest.mark.parametrize(
    ("width", "height", "disparities"), [(640, 480, 320), (1280, 720, 640), (1920, 1080, 960), (1632, 1224, 816)]
)
def test_small_images_are_matched_as_they_are(width: int, height: int, disparities: int) -> None:
    """Up to two megapixels nothing is reduced, with N as large as half the width, which is the most that a rig gets."""
    assert chosen_scale(width, height, disparities) == 1


@given(st.integers(1, 12_000), st.integers(1, 12_000), st.integers(1, 6000))
def test_large_images_stay_within_work_and_memory(width: int, height: int, disparities: int) -> None:
    """Whatever the size, the matched images cost at most twice the budget (they are not reduced for less), and N fits the matcher."""
    scale = chosen_scale(width, height, disparities)
    assert 0 < scale <= 1
    searched = min(disparities, width) * scale
    assert width * height * scale**2 * searched <= MOST_STEPS / 0.8**3 * 1.001
    assert width * height * scale**2 <= MOST_PIXELS / 0.8**2 * 1.001
    assert searched <= 2032.001


def test_twelve_megapixels_are_reduced() -> None:
    """4000x3000 with N = 1104 is 13.2 G steps, so the scale is the cube root of 1.2 / 13.2."""
    assert chosen_scale(4000, 3000, 1104) == pytest.approx((1.2 / 13.248) ** (1 / 3), rel=1e-3)


def test_reducing_averages() -> None:
    """A 1-px checkerboard at half size is grey; at scale 1 the image is not copied."""
    board = (np.indices((40, 60)).sum(axis=0) % 2 * 255).astype(np.uint8)
    assert reduced(board, 1.0) is board
    half = reduced(board, 0.5)
    assert half.shape == (20, 30)
    assert half.min() >= 127
    assert half.max() <= 128


@pytest.mark.parametrize("epipolar", Epipolar)
def test_a_slanted_surface_comes_back_to_a_fraction_of_a_pixel(epipolar: Epipolar) -> None:
    """A plane's disparity is linear; at 2.5 times the size it is 2.5 times as large, at the pixel's own place."""
    rows, columns = np.indices((40, 60), dtype=np.float32)
    small = np.float32(10) + np.float32(0.1) * columns + np.float32(0.05) * rows
    full = to_full_size(small, 150, 100, epipolar)
    rows, columns = np.indices((100, 150), dtype=np.float32)
    expected = 2.5 * (10 + 0.1 * ((columns + 0.5) / 2.5 - 0.5) + 0.05 * ((rows + 0.5) / 2.5 - 0.5))
    assert np.isfinite(full).all()
    assert np.abs(full - expected)[4:-4, 4:-4].max() < 1e-3


def test_nothing_appears_between_two_surfaces() -> None:
    """Across an edge from 5 to 20 px, only these two disparities exist at three times the size, and the edge stays where it was."""
    small = np.full((20, 20), 5, np.float32)
    small[:, 10:] = 20
    full = to_full_size(small, 60, 60, Epipolar.LEFT)
    assert set(np.unique(full)) == {15.0, 60.0}
    assert (full[:, :30] == 15).all()


def test_holes_keep_their_size() -> None:
    """A hole of 4 x 3 px is one of 12 x 9 px at three times the size: it neither closes nor grows."""
    small = np.full((20, 20), 5, np.float32)
    small[6:9, 5:9] = np.nan
    full = to_full_size(small, 60, 60, Epipolar.LEFT)
    hole = np.isnan(full)
    assert hole.sum() == 12 * 9
    assert hole[18:27, 15:27].all()


def test_the_same_size_is_the_same_map() -> None:
    """Without a reduction not a bit changes."""
    disparity = np.array([[1.0, np.nan]], np.float32)
    assert to_full_size(disparity, 2, 1, Epipolar.LEFT) is disparity


@pytest.mark.parametrize(
    ("epipolar", "step"), [(Epipolar.LEFT, (0, -3)), (Epipolar.UP, (-3, 0)), (Epipolar.DOWN, (3, 0))]
)
def test_a_point_moves_to_the_left_once_the_image_lies(epipolar: Epipolar, step: tuple[int, int]) -> None:
    """A mark that moves by 3 px along its epipolar line moves 3 px to the left in the turned images; turning back restores every pixel."""
    left, right = np.zeros((2, 20, 30), np.uint8)
    left[10, 15] = 255
    right[10 + step[0], 15 + step[1]] = 255
    (row, column), (row_right, column_right) = (np.argwhere(lying(image, epipolar))[0] for image in (left, right))
    assert (row_right, column_right) == (row, column - 3)
    values = noise(30, 20).astype(np.float32)
    np.testing.assert_array_equal(upright_again(lying(values, epipolar), epipolar), values)


@given(st.sampled_from(Epipolar), st.integers(0, 90), st.integers(0, 70), st.integers(1, 60), st.integers(0, 40))
def test_a_crops_part_holds_every_partner(epipolar: Epipolar, x: int, y: int, size: int, disparities: int) -> None:
    """For each pixel of the crop, all places that the search may reach lie in the part, as far as the image goes."""
    crop = Crop(x_px=x, y_px=y, width_px=min(size, 100 - x), height_px=min(size, 80 - y))
    part = part_for(crop, (100, 80), disparities, epipolar=epipolar, margin_px=0)
    reach = disparities or 100
    far = {Epipolar.LEFT: (-reach, 0), Epipolar.UP: (0, -reach), Epipolar.DOWN: (0, reach)}[epipolar]
    for column in (x, x + crop.width_px - 1):
        for row in (y, y + crop.height_px - 1):
            assert part.columns.start <= column < part.columns.stop
            assert part.rows.start <= row < part.rows.stop
            assert part.columns.start <= max(column + far[0], 0)
            assert part.rows.start <= max(row + far[1], 0)
            assert part.rows.stop > min(row + far[1], 79)
    pair = part.of(RectifiedPair(noise(100, 80), noise(100, 80), epipolar))
    assert pair.left.shape[::-1] == part.size_px
    placed = part.placed(np.ones(pair.left.shape, np.float32), 100, 80)
    assert np.nansum(placed) == crop.width_px * crop.height_px
    assert (placed[y : y + crop.height_px, x : x + crop.width_px] == 1).all()


def test_confidence_is_kept_only_where_there_is_a_disparity() -> None:
    """NaN and both infinities are none; 0, negative and the greatest finite numbers are."""
    greatest = np.finfo(np.float32).max
    disparity = np.array([[0, -1.5, np.nan, np.inf], [-np.inf, greatest, -greatest, 7]], np.float32)
    confidence = np.array([[1, 2, 3, 4], [5, 6, 7, 255]], np.uint8)
    known = confidence_of_known(confidence, disparity)
    assert known.tolist() == [[1, 2, 0, 0], [0, 6, 7, 255]]
    assert confidence.tolist() == [[1, 2, 3, 4], [5, 6, 7, 255]]
