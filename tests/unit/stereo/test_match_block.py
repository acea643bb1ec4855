"""The paper's matcher against its definition, written out as loops."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from phone_host.model import Image, RectifiedPair
from phone_host.stereo.match_block import STRIP_ROWS, BlockMatcher, equiangular_offset, points_back, search
from tests.support.planes import noise


def slow_sad(left: NDArray[np.int64], right: NDArray[np.int64], x: int, y: int, d: int) -> int:
    """The definition: absolute differences over x-4 .. x+3, y-4 .. y+3, the images continued by their nearest pixel."""
    # The right window is the same window d further left; pixel (x, y) is at (x + 4, y + 4) of a continued image.
    here, there = left[y : y + 8, x : x + 8], right[y : y + 8, x - d : x - d + 8]
    return int(np.abs(here - there).sum())


def continued(image: Image) -> NDArray[np.int64]:
    """An image with four more pixels on each side, equal to their nearest."""
    return np.pad(image.astype(np.int64), 4, mode="edge")


def slow_search(left_image: Image, right_image: Image, disparities: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The least SAD of every left and every right pixel, the lowest d on a tie."""
    height, width = left_image.shape
    left_px, right_px = np.zeros((2, height, width), np.int32)
    left, right = continued(left_image), continued(right_image)
    for y in range(height):
        for x in range(width):
            of_left = [slow_sad(left, right, x, y, d) for d in range(disparities) if d <= x]
            of_right = [slow_sad(left, right, x + d, y, d) for d in range(disparities) if x + d < width]
            left_px[y, x] = of_left.index(min(of_left))
            right_px[y, x] = of_right.index(min(of_right))
    return left_px, right_px


@settings(deadline=None, max_examples=25)
@given(data=st.data(), width=st.integers(1, 14), height=st.integers(1, 10), disparities=st.integers(1, 16))
def test_search_is_the_definition_bit_for_bit(data: st.DataObject, width: int, height: int, disparities: int) -> None:
    """Both views' whole-pixel winners equal the loops'; with few grey levels ties are frequent."""
    levels = arrays(np.uint8, (height, width), elements=st.sampled_from([0, 1, 2, 255]))
    left, right = data.draw(levels), data.draw(levels)
    winners = search(left, right, disparities)
    left_px, right_px = slow_search(left, right, disparities)
    assert (winners.left_px == left_px).all()
    assert (winners.right_px == right_px).all()


def test_strips_leave_no_seam() -> None:
    """An image taller than two strips has the loops' winners on every row."""
    left, right = noise(12, 2 * STRIP_ROWS + 5, seed=1), noise(12, 2 * STRIP_ROWS + 5, seed=2)
    winners = search(left, right, 6)
    left_px, right_px = slow_search(left, right, 6)
    assert (winners.left_px == left_px).all()
    assert (winners.right_px == right_px).all()


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 10_000), shift=st.integers(0, 5))
def test_match_is_winners_checked_and_refined(seed: int, shift: int) -> None:
    """A value exists where the right pixel points back to within 1 px, and lies within half a pixel of the winner."""
    left = noise(24, 12, seed)
    right = np.where(noise(24, 12, seed + 1) < 60, noise(24, 12, seed + 2), np.roll(left, -shift, axis=1))
    disparity = BlockMatcher(8).match(RectifiedPair(left, right))
    left_px, right_px = slow_search(left, right, 8)
    for y in range(12):
        for x in range(24):
            d = int(left_px[y, x])
            confirmed = abs(int(right_px[y, x - d]) - d) <= 1
            assert np.isnan(disparity[y, x]) == (not confirmed)
            assert not confirmed or abs(float(disparity[y, x]) - d) <= 0.5


def test_left_right_check_by_hand() -> None:
    """Pixel 3 points to right pixel 1, which points back exactly; pixel 4 points to right pixel 2, which misses it by 2 px."""
    left_px = np.array([[0, 0, 0, 2, 2]], np.int32)
    right_px = np.array([[0, 2, 4, 0, 0]], np.int32)
    assert points_back(left_px, right_px)[0, 3:].tolist() == [True, False]


@settings(deadline=None)
@given(at=st.floats(1.5, 3.49), slope=st.integers(100, 2000))
def test_v_shaped_costs_are_refined_exactly(at: float, slope: int) -> None:
    """For costs slope * |d - at| the refined winner is `at`, up to the rounding of costs to whole numbers."""
    cost = [round(slope * abs(d - at)) for d in range(6)]
    winner = cost.index(min(cost))
    keys = np.full((8, 1, 1), np.iinfo(np.int32).max, np.int32)
    keys[1:7, 0, 0] = [(c << 16) + d for d, c in enumerate(cost)]
    offset = equiangular_offset(keys, np.array([[winner]], np.int32))
    assert winner + offset[0, 0] == pytest.approx(at, abs=3 / slope)


def test_ends_of_the_range_stay_whole() -> None:
    """If only one neighbour was searched there is nothing to fit: the value is a whole number."""
    left = noise(40, 20, seed=3)
    disparity = BlockMatcher(4).match(RectifiedPair(left, np.roll(left, -3, axis=1)))
    assert (disparity[:, 10:-10] == 3).all()


def test_no_whole_window_no_value() -> None:
    """An image with fewer rows than the window's 8 holds no whole window: all NaN."""
    image = noise(40, 7)
    assert np.isnan(BlockMatcher(4).match(RectifiedPair(image, image))).all()
