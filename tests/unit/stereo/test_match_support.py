"""Disparity stays where the images support it: not one period off, not invented on a plain wall, and thin things survive."""

import cv2
import numpy as np

from phone_host.model import Image, RectifiedPair
from phone_host.stereo.match_sgbm import SgbmMatcher, cost_of, sides, supported, without_doubtful_bridges
from tests.support.planes import noise

TRUE_PX, PERIOD_PX = 10, 24


def _shifted(wide: Image, shift_px: int) -> tuple[Image, Image]:
    width = wide.shape[1] - shift_px
    return wide[:, :width].copy(), wide[:, shift_px:].copy()


def _tiles(width_px: int, height_px: int) -> Image:
    """Tiles that repeat every PERIOD_PX, in a frame of texture."""
    x, y = np.meshgrid(np.arange(width_px), np.arange(height_px))
    tiles = np.where((x // (PERIOD_PX // 2) + y // (PERIOD_PX // 2)) % 2, 180, 60).astype(np.uint8)
    framed = np.asarray(cv2.blur(noise(width_px, height_px, seed=5), (3, 3)), np.uint8)
    framed[30:-30, 60:-60] = tiles[30:-30, 60:-60]
    return framed


def _noisy(image: Image, sigma: float, seed: int) -> Image:
    random = np.random.default_rng(seed)
    return np.clip(np.rint(image + random.normal(0, sigma, image.shape)), 0, 255).astype(np.uint8)


def test_a_region_one_period_off_gives_way_to_the_surface_around_it() -> None:
    """On tiles, a block that is one period off fits the images as well as the guide does; it gets the guide's value."""
    left, right = _shifted(_tiles(300, 160), TRUE_PX)
    guide = np.full(left.shape, TRUE_PX, np.float32)
    wrong = guide.copy()
    wrong[60:100, 120:180] += PERIOD_PX
    mended = supported(left, right, wrong, guide)
    assert np.abs(mended[60:100, 120:180] - TRUE_PX).max() == 0


def test_a_thin_thing_that_the_guide_smooths_away_stays() -> None:
    """A bar 6 px wide with a texture of its own keeps its disparity, though the guide knows only the wall behind it."""
    left, right = _shifted(np.asarray(cv2.blur(noise(300, 120, seed=1), (3, 3)), np.uint8), TRUE_PX)
    bar = noise(6, 120, seed=2)
    left[:, 150:156] = bar
    right[:, 150 - 30 : 156 - 30] = bar
    guide = np.full(left.shape, TRUE_PX, np.float32)
    found = guide.copy()
    found[:, 150:156] = 30
    assert (supported(left, right, found, guide)[:, 151:155] == 30).all()


def test_a_hole_is_completed_only_where_values_on_all_sides_confirm_the_guide() -> None:
    """A hole inside a surface takes the guide's values; one at the image's edge, with nothing beyond it, stays open."""
    left, right = _shifted(np.asarray(cv2.blur(noise(200, 100, seed=4), (3, 3)), np.uint8), TRUE_PX)
    guide = np.full(left.shape, TRUE_PX, np.float32)
    holed = guide.copy()
    holed[40:60, 80:110] = np.nan
    holed[:, 170:] = np.nan
    completed = supported(left, right, holed, guide)
    assert (completed[40:60, 80:110] == TRUE_PX).all()
    assert np.isnan(completed[:, 170:]).all()


def test_a_bridge_that_leaves_the_guide_is_opened_again() -> None:
    """Of two bridged gaps, the one 3 px beside the guide is opened; measured values stay wherever they are."""
    before = np.array([[10, np.nan, 10, 13, np.nan, 13]], np.float32)
    bridged = np.array([[10, 10, 10, 13, 13, 13]], np.float32)
    guide = np.full((1, 6), 10, np.float32)
    opened = without_doubtful_bridges(bridged, before, guide)
    assert np.array_equal(opened, np.array([[10, 10, 10, 13, np.nan, 13]], np.float32), equal_nan=True)


def test_a_break_of_the_guide_ends_its_surface() -> None:
    """From a pixel behind a step of the guide, no value of the other side is reached."""
    guide = np.repeat(np.array([[5.0] * 10 + [20.0] * 10], np.float32), 8, axis=0)
    known = guide.copy()
    known[:, 8:18] = np.nan
    to_left, to_right, _, _ = sides(known, guide)
    assert to_left[0, 9]
    assert not to_right[0, 9]
    assert not to_left[0, 12]
    assert to_right[0, 12]


def test_the_right_disparity_costs_least() -> None:
    """Of three disparities, the true one has the least cost nearly everywhere."""
    left, right = _shifted(np.asarray(cv2.blur(noise(200, 100, seed=6), (3, 3)), np.uint8), TRUE_PX)
    costs = [cost_of(left, right, np.full(left.shape, by, np.float32))[:, 30:] for by in (8, TRUE_PX, 12)]
    assert (np.argmin(costs, axis=0) == 1).mean() > 0.99


def test_a_plain_wall_in_unlike_views_gets_its_depth_or_none() -> None:
    """A wall with nothing but camera noise, framed by texture, in views of unlike content: at most 2 % of its values are wrong."""
    wide = np.asarray(cv2.blur(noise(460, 200, seed=7), (3, 3)), np.uint8)
    wide[40:160, 120:360] = 140
    left, right = _shifted(wide, 40)
    left[:, :40], right[:, -40:] = 240, 15
    pair = RectifiedPair(_noisy(left, 2, 1), _noisy(np.rint(right * 0.8 + 10).astype(np.uint8), 2, 2))
    wall = SgbmMatcher(96).match(pair)[48:152, 128:352]
    valued = np.isfinite(wall)
    assert (np.abs(wall[valued] - 40) > 2).mean() <= 0.02


def test_tiles_are_not_matched_one_period_off() -> None:
    """Of a tiled surface in a textured frame, at most 1 % of the values are off by more than 2 px, and most pixels have one."""
    left, right = _shifted(_tiles(420, 220), 30)
    tiles = SgbmMatcher(96).match(RectifiedPair(_noisy(left, 2, 3), _noisy(right, 2, 4)))[34:-34, 64:320]
    valued = np.isfinite(tiles)
    assert valued.mean() > 0.6
    assert (np.abs(tiles[valued] - 30) > 2).mean() <= 0.01
