"""The own matcher's guide and support: no depth invented on plain walls and tiles, and the same bits everywhere."""

from itertools import product

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Image, RectifiedPair
from phone_host.native.library import Library
from phone_host.stereo.match_tandem import TandemMatcher
from tests.support.planes import noise

PERIOD_PX = 24


def _shifted(wide: Image, shift_px: int) -> tuple[Image, Image]:
    width = wide.shape[1] - shift_px
    return wide[:, :width].copy(), wide[:, shift_px:].copy()


def _texture(width_px: int, height_px: int, seed: int) -> Image:
    return np.asarray(cv2.blur(noise(width_px, height_px, seed=seed), (3, 3)), np.uint8)


def _noisy(image: Image, sigma: float, seed: int) -> Image:
    random = np.random.default_rng(seed)
    return np.clip(np.rint(image + random.normal(0, sigma, image.shape)), 0, 255).astype(np.uint8)


def _matched(left: Image, right: Image, disparities: int, library: Library, threads: int = 1) -> NDArray[np.float32]:
    return TandemMatcher(disparities, library, threads).match(RectifiedPair(left, right))


def test_a_plain_wall_gets_its_depth_or_none(native_library: Library) -> None:
    """A wall with nothing but camera noise, 40 px, framed by texture: at most 2 % of its values are off by more than 2 px."""
    wide = _texture(460, 200, seed=7)
    wide[40:160, 120:360] = 140
    left, right = _shifted(wide, 40)
    wall = _matched(_noisy(left, 2, 1), _noisy(right, 2, 2), 96, native_library)[48:152, 128:352]
    valued = np.isfinite(wall)
    assert (np.abs(wall[valued] - 40) > 2).mean() <= 0.02


def test_tiles_are_not_matched_one_period_off(native_library: Library) -> None:
    """Of a tiled surface in a textured frame at most 1 % of the values are off by more than 2 px, and most pixels have one."""
    wide = _texture(420, 220, seed=5)
    x, y = np.meshgrid(np.arange(420), np.arange(220))
    tiles = np.where((x // (PERIOD_PX // 2) + y // (PERIOD_PX // 2)) % 2, 180, 60).astype(np.uint8)
    wide[30:-30, 60:-60] = tiles[30:-30, 60:-60]
    left, right = _shifted(wide, 30)
    found = _matched(_noisy(left, 2, 3), _noisy(right, 2, 4), 96, native_library)[34:-34, 64:320]
    valued = np.isfinite(found)
    assert valued.mean() > 0.6
    assert (np.abs(found[valued] - 30) > 2).mean() <= 0.01


def test_a_thin_bar_before_a_wall_keeps_its_depth(native_library: Library) -> None:
    """A bar 8 px wide, 20 px before a textured wall, survives a guide that is smooth: most of it has its own disparity."""
    left, right = _shifted(_texture(300, 120, seed=1), 10)
    bar = noise(8, 120, seed=2)
    left[:, 150:158], right[:, 120:128] = bar, bar
    found = _matched(left, right, 64, native_library)[10:-10, 151:157]
    assert (np.abs(found - 30) <= 1).mean() > 0.8


@pytest.mark.parametrize(
    ("width", "height", "disparities"),
    [(1, 1, 1), (5, 3, 4), (33, 17, 20), (640, 1, 64), (1, 40, 9), (161, 75, 70), (97, 300, 130)],
)
def test_results_do_not_depend_on_instruction_set_or_threads(
    native_library: Library, width: int, height: int, disparities: int
) -> None:
    """Images of any size, half of them plain, give the same bits on every instruction set and with 1, 2, 3 and 8 threads."""
    wide = _texture(width + 7, height, seed=9)
    wide[height // 3 :, width // 2 :] = 90
    left, right = _shifted(wide, 7)
    right = _noisy(right, 3, 11)
    results = {
        _matched(left, right, disparities, native_library.using(simd), threads).tobytes()
        for simd, threads in product(native_library.usable_sets(), (1, 2, 3, 8))
    }
    assert len(results) == 1
