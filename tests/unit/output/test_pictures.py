"""Pictures of disparity and depth: colours, and a scale whose ticks lie where geometry puts them."""

import cv2
import numpy as np
import pytest

from phone_host.model import StereoGeometry
from phone_host.output.preview import (
    colour_disparity,
    colour_range_px,
    depth_picture,
    depth_range_m,
    disparity_picture,
)
from phone_host.output.scale_bar import Tick, ticks, with_scale

_LUMA = np.array([0.114, 0.587, 0.299])  # ITU-R BT.601, of blue, green, red


def test_disparity_is_black_without_value_and_brighter_when_nearer() -> None:
    """NaN is black, nothing else is, and lightness rises with disparity."""
    disparity = np.linspace(0, 60, 64, dtype=np.float32).reshape(8, 8)
    disparity[0, 0] = np.nan
    colours = colour_disparity(disparity, 0, 60)
    assert colours[0, 0].tolist() == [0, 0, 0]
    lightness = (colours @ _LUMA).ravel()[1:]
    assert (np.diff(lightness) > -1.0).all()  # rounding to 8 bits
    assert lightness[0] > 20
    assert lightness[-1] > 200


def test_depth_is_brighter_when_nearer_and_infinite_depth_is_black() -> None:
    """Depth has the same colours the other way round."""
    depth = np.array([[1, 2, 3, np.nan, np.inf]], dtype=np.float32)
    picture = depth_picture(np.dstack([depth, depth, depth]))[:, :5]
    lightness = picture[0] @ _LUMA
    assert lightness[0] > lightness[1] > lightness[2] > 20
    assert not picture[0, 3:].any()


@pytest.mark.parametrize("geometry", [None, StereoGeometry(focal_px=100, baseline_m=0.1, cx_px=2, cy_px=2)])
def test_a_map_without_values_is_black_and_has_no_scale(geometry: StereoGeometry | None) -> None:
    """Nothing is made up where nothing was found: the pictures are black and as large as the map."""
    nothing = np.full((40, 50), np.nan, dtype=np.float32)
    picture = disparity_picture(nothing, geometry)
    assert picture.shape == (40, 50, 3)
    assert not picture.any()
    assert colour_range_px(nothing) == (0, 1)
    assert np.array_equal(depth_picture(np.full((40, 50, 3), np.nan, dtype=np.float32)), picture)
    assert depth_range_m(nothing) == (1, 2)


def test_the_scale_stands_beside_the_picture_and_hides_none_of_it() -> None:
    """The picture's own pixels keep place and colour; the rest is added on the right."""
    disparity = np.linspace(1, 30, 100 * 160, dtype=np.float32).reshape(100, 160)
    picture = disparity_picture(disparity)
    assert picture.shape[0] == 100
    assert picture.shape[1] > 160
    low_px, high_px = colour_range_px(disparity)
    np.testing.assert_array_equal(picture[:, :160], colour_disparity(disparity, low_px, high_px))


def test_ticks_are_round_numbers_at_their_places_and_keep_their_distance() -> None:
    """From 1 to 10 on an even scale there are 1 and 10 at the ends, 2 and 5 between, and nothing closer than the pitch."""
    found = ticks(1, 10, lambda number: (number - 1) / 9, 0.1)
    by_text = {tick.text: tick.place for tick in found}
    assert by_text["1"] == 0
    assert by_text["10"] == 1
    assert by_text["2"] == pytest.approx(1 / 9)
    assert by_text["5"] == pytest.approx(4 / 9)
    places = sorted(by_text.values())
    assert np.diff(places).min() >= 0.1
    assert all(float(text) == pytest.approx(1 + 9 * place) for text, place in by_text.items())


@pytest.mark.parametrize(("low", "high"), [(0.41, 0.47), (2.2, 4.9), (0.3, float("inf")), (66, 140), (1e-3, 1e3)])
def test_every_range_gets_labels_without_leaving_a_large_gap(low: float, high: float) -> None:
    """On a scale that is even in 1 / z, as disparity is, at least three numbers stand, and none outside the range."""
    bottom, top = 1 / high, 1 / low
    found = ticks(low, high, lambda z: (1 / z - bottom) / (top - bottom), 0.08)
    assert len(found) >= 3
    assert all(low <= float(tick.text) <= high for tick in found)


def test_a_tick_lies_beside_the_colour_of_its_disparity() -> None:
    """Depth 2 m is disparity 100 * 0.1 / 2 = 5 px: beside the label 2, the bar has the colour of 5 px in the picture."""
    geometry = StereoGeometry(focal_px=100, baseline_m=0.1, cx_px=0, cy_px=0)
    disparity = np.repeat(np.linspace(1, 10, 600, dtype=np.float32)[:, np.newaxis], 400, axis=1)
    low_px, high_px = colour_range_px(disparity)
    marks = {tick.text: tick.place for tick in ticks(1.0, 10.0, lambda z: (10 / z - low_px) / (high_px - low_px), 0.05)}
    assert marks["2"] == pytest.approx((5 - low_px) / (high_px - low_px))
    picture = disparity_picture(disparity, geometry)
    strip = picture[:, 400:]
    bar = strip[:, 5]  # half a letter of 10 px from the picture
    coloured = np.flatnonzero(np.any(bar != 255, axis=1))
    row = round(coloured[-1] - marks["2"] * (coloured[-1] - coloured[0]))
    expected = colour_disparity(np.array([[5]], np.float32), low_px, high_px)[0, 0].astype(int)
    assert np.abs(strip[row, 5].astype(int) - expected).max() <= 4  # one row is half a colour level
    beside = strip[row - 1 : row + 2, 5 + 11 + 1 : 5 + 11 + 4]
    assert (beside < 128).all(axis=2).any()  # its tick


@pytest.mark.parametrize("width", [640, 4000])
def test_labels_can_be_read_on_a_phone_whatever_the_size_of_the_picture(width: int) -> None:
    """Shown 390 px wide, a digit is at least 7 px high: about the height of 10 point text."""
    height = width * 3 // 4
    blank = np.zeros((height, width, 3), np.uint8)
    colours = np.zeros((2, 3), np.uint8)
    picture = with_scale(blank, colours, lambda _: (Tick(0.5, "1"),), "m")
    x = width + round(width / 38) * 2  # behind the bar and the tick
    rows = np.flatnonzero(np.all(picture[height // 4 : height * 3 // 4, x:] < 128, axis=2).any(axis=1))
    digit_px = rows[-1] - rows[0] + 1
    assert digit_px * 390 / picture.shape[1] >= 7


def test_a_flat_scene_is_not_stretched_to_all_colours() -> None:
    """Noise of a tenth of a pixel, or of a thousandth of the depth, stays one colour."""
    noise = np.random.default_rng(1).normal(scale=0.02, size=(60, 80)).astype(np.float32)
    low_px, high_px = colour_range_px(30 + noise)
    assert high_px - low_px >= 1
    near_m, far_m = depth_range_m((2 + noise / 20).astype(np.float32))
    assert far_m / near_m >= 1.019


def test_a_tiny_picture_still_gets_a_scale() -> None:
    """A crop of a few pixels is no error."""
    assert disparity_picture(np.ones((2, 3), np.float32)).shape[0] == 2
    assert cv2.imencode(".png", depth_picture(np.ones((2, 3, 3), np.float32)))[0]
