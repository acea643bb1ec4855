"""What every matcher must do. A new matcher adds one line to MATCHERS. Hard inputs: test_matcher_inputs."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError, SettingsError
from phone_host.model import RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from tests.support.planes import noise, plane

MATCHERS = [
    MatcherName.BLOCK,
    MatcherName.SGBM,
    MatcherName.TANDEM,
]

every_matcher = pytest.mark.parametrize("name", MATCHERS, ids=lambda name: name.value)


def shifted(width_px: int, height_px: int, by_px: int, seed: int = 0) -> RectifiedPair:
    """A noise image and the same image shifted left by `by_px`: its disparity is `by_px` wherever both images show it."""
    wide = np.asarray(cv2.blur(noise(width_px + by_px, height_px, seed), (3, 3)), np.uint8)
    # Left shows the columns 0 .. W-1, right the columns by .. by+W-1: column c lies at c left and at c - by right.
    return RectifiedPair(wide[:, :width_px], wide[:, by_px:])


def test_every_matcher_is_under_contract() -> None:
    """This suite tests every matcher that a user can name."""
    assert set(MATCHERS) == set(MatcherName)


@every_matcher
@settings(deadline=None, max_examples=40)
@given(
    size=st.tuples(st.integers(1, 40), st.integers(1, 70)),
    disparities=st.integers(1, 130),
    seed=st.integers(0, 1000),
    other_seed=st.integers(0, 2),
)
def test_shape_type_and_range(
    name: MatcherName, size: tuple[int, int], disparities: int, seed: int, other_seed: int
) -> None:
    """Any size and any N give float32 of the image's size, each value NaN or in [0, N), for similar and dissimilar images."""
    height, width = size
    pair = RectifiedPair(noise(width, height, seed), np.roll(noise(width, height, seed + other_seed), -3, axis=1))
    disparity = create_matcher(MatchSettings(name, disparities)).match(pair)
    assert disparity.dtype == np.float32
    assert disparity.shape == size
    values = disparity[~np.isnan(disparity)]
    assert ((values >= 0) & (values < disparities)).all()


@every_matcher
def test_single_pixel_has_no_disparity(name: MatcherName) -> None:
    """One pixel has nothing to be compared with."""
    one = np.full((1, 1), 77, np.uint8)
    assert np.isnan(create_matcher(MatchSettings(name, 64)).match(RectifiedPair(one, one))).all()


@every_matcher
@pytest.mark.parametrize("disparities", [8, 16, 23, 64])
def test_finds_a_whole_pixel_shift(name: MatcherName, disparities: int) -> None:
    """A texture shifted by 7 px has disparity 7 where both images show it, for every N above 7."""
    disparity = create_matcher(MatchSettings(name, disparities)).match(shifted(120, 60, 7))
    seen = disparity[4:-4, 7 + 4 : -4]
    assert (np.abs(seen - 7) < 0.2).mean() > 0.95


@every_matcher
@pytest.mark.parametrize("slope_x", [0.03, 0.1, -0.05])
def test_slanted_plane_below_a_sixth_of_a_pixel(name: MatcherName, slope_x: float) -> None:
    """On a noise-free slanted plane the median error is at most 0.15 px, and nearly every pixel has a value."""
    scene = plane(near_px=20 if slope_x > 0 else 40, slope_x=slope_x)
    disparity = create_matcher(MatchSettings(name, 64)).match(scene.pair)
    x = np.arange(disparity.shape[1])
    seen = (x - scene.disparity_px > 4) & (x < disparity.shape[1] - 4)
    error = np.abs(disparity - scene.disparity_px)[seen]
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmedian(error) <= 0.15


@every_matcher
def test_what_the_right_camera_cannot_see_gets_no_foreground_value(name: MatcherName) -> None:
    """Where a near square hides the background from the right camera, the background does not get the square's disparity."""
    background_px, square_px = 4, 24
    wide = shifted(240, 120, background_px, seed=3)
    left, right = wide.left.copy(), wide.right.copy()
    square = noise(80, 60, seed=4)
    left[30:90, 100:180] = square
    right[30:90, 100 - square_px : 180 - square_px] = square
    disparity = create_matcher(MatchSettings(name, 40)).match(RectifiedPair(left, right))
    # Left of the square: the right camera sees the square up to x = 180 - 24 = 156, so it sees background at x - 4 in 76 .. 95.
    hidden = disparity[36:84, 82:96]
    assert (np.abs(hidden - square_px) < 2).mean() < 0.1


@every_matcher
def test_unrelated_images_have_little_in_common(name: MatcherName) -> None:
    """For two independent noise images most pixels get no value."""
    pair = RectifiedPair(noise(200, 120, seed=1), noise(200, 120, seed=2))
    disparity = create_matcher(MatchSettings(name, 64)).match(pair)
    assert np.isnan(disparity).mean() > 0.6


@every_matcher
def test_result_depends_on_the_pair_alone(name: MatcherName) -> None:
    """A matcher that has seen other pairs, larger and smaller, gives the same bits as a fresh one."""
    pair = plane(seed=5).pair
    used = create_matcher(MatchSettings(name, 48))
    for other in (shifted(400, 200, 9), shifted(20, 9, 2), plane(seed=6).pair):
        used.match(other)
    fresh = create_matcher(MatchSettings(name, 48)).match(pair)
    assert used.match(pair).tobytes() == fresh.tobytes()
    assert used.match(pair).tobytes() == fresh.tobytes()


@every_matcher
def test_result_does_not_depend_on_threads(name: MatcherName) -> None:
    """The result is bit-identical for any number of OpenCV threads."""
    pair = plane(width_px=400, height_px=250, seed=7).pair
    before = cv2.getNumThreads()
    results = set()
    try:
        for threads in (1, 2, 3, 8):
            cv2.setNumThreads(threads)
            results.add(create_matcher(MatchSettings(name, 64)).match(pair).tobytes())
    finally:
        cv2.setNumThreads(before)
    assert len(results) == 1


@every_matcher
def test_colour_and_grey_are_both_taken(name: MatcherName) -> None:
    """A pair in colours that are all grey gives the same result as the grey pair, even if only one image is in colour."""
    pair = plane(seed=8).pair
    left, right = (np.repeat(image[..., None], 3, axis=2) for image in (pair.left, pair.right))
    matcher = create_matcher(MatchSettings(name, 48))
    expected = matcher.match(pair).tobytes()
    assert matcher.match(RectifiedPair(left, right)).tobytes() == expected
    assert matcher.match(RectifiedPair(pair.left, right)).tobytes() == expected


@every_matcher
def test_input_is_only_read(name: MatcherName) -> None:
    """Read-only views into larger arrays are matched directly and not modified."""
    whole = plane(seed=9).pair
    left, right = whole.left[5:-6, 3:-8], whole.right[5:-6, 3:-8]
    for view in (left, right):
        view.setflags(write=False)
    copies = RectifiedPair(left.copy(), right.copy())
    matcher = create_matcher(MatchSettings(name, 48))
    assert matcher.match(RectifiedPair(left, right)).tobytes() == matcher.match(copies).tobytes()
    assert (left == copies.left).all()
    assert (right == copies.right).all()


@every_matcher
def test_images_of_two_sizes_are_refused_in_one_line(name: MatcherName) -> None:
    """A pair that was not rectified to one size is an error in the data, and the message names both sizes."""
    pair = RectifiedPair(noise(40, 30), noise(41, 30))
    with pytest.raises(DataError) as caught:
        create_matcher(MatchSettings(name, 16)).match(pair)
    assert "40x30" in str(caught.value)
    assert "41x30" in str(caught.value)
    assert "\n" not in str(caught.value)


@every_matcher
@pytest.mark.parametrize("shape", [(0, 5), (5, 0), (4, 4, 4), (4, 4, 1), (4,)])
def test_what_is_no_image_is_refused(name: MatcherName, shape: tuple[int, ...]) -> None:
    """Empty arrays and other numbers of channels are refused with a DataError."""
    image = np.zeros(shape, np.uint8)
    with pytest.raises(DataError):
        create_matcher(MatchSettings(name, 16)).match(RectifiedPair(image, image))


@every_matcher
def test_sixteen_bits_are_refused(name: MatcherName) -> None:
    """Images of 16 bits must be reduced first; a matcher does not guess their white level."""
    image = np.zeros((8, 8), np.uint16)
    with pytest.raises(DataError):
        create_matcher(MatchSettings(name, 16)).match(RectifiedPair(image, image))  # type: ignore[arg-type]


@pytest.mark.parametrize("disparities", [0, -1])
def test_an_empty_search_range_is_refused(disparities: int) -> None:
    """Less than one disparity is an invalid setting."""
    with pytest.raises(SettingsError):
        MatchSettings(disparities=disparities)


@every_matcher
@pytest.mark.parametrize("disparities", [1, 16, 64])
def test_what_has_no_texture_has_no_disparity(name: MatcherName, disparities: int) -> None:
    """Images of a uniform grey, or of uniform rows, match at any shift: no pixel gets a value, least of all 0, which means infinitely far."""
    matcher = create_matcher(MatchSettings(name, disparities))
    stripes = np.repeat(noise(1, 50, seed=3), 70, axis=1)
    for left, right in (
        (np.full((50, 70), 128, np.uint8), np.full((50, 70), 128, np.uint8)),
        (np.zeros((50, 70), np.uint8), np.zeros((50, 70), np.uint8)),
        (np.full((50, 70), 90, np.uint8), np.full((50, 70), 140, np.uint8)),
        (stripes, stripes),
    ):
        assert np.isnan(matcher.match(RectifiedPair(left, right))).all()


@every_matcher
def test_a_black_border_has_no_disparity(name: MatcherName) -> None:
    """Rows above the scene that rectification has painted black get no value; the scene below keeps its values."""
    pair = plane(seed=12).pair
    left, right = (np.vstack([np.zeros((24, image.shape[1]), np.uint8), image]) for image in (pair.left, pair.right))
    matcher = create_matcher(MatchSettings(name, 48))
    disparity = matcher.match(RectifiedPair(left, right))
    assert np.isnan(disparity[:20]).all()
    assert np.isfinite(disparity[24:]).mean() > 0.5
