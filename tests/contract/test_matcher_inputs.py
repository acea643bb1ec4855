"""What every matcher must do with hard inputs: bare walls, mirrors, one column, dead rows, saturation, any strides, hostile pairs before."""

from collections.abc import Callable
from typing import Any, Final

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.model import Image, RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.matcher_protocol import ReportingMatcher
from tests.contract.test_matcher import every_matcher, shifted
from tests.support.planes import noise, plane

_FROM_ABOVE: Final = "rows that change nowhere take the path costs of the rows above, and 0 wins"
_SPREADS: Final = (
    "where one image is white every disparity costs the same, and the neighbouring surface spreads over it"
)
KNOWN_LIMITS: Final = {
    (MatcherName.SGBM, "both images, bottom half, 0"): _FROM_ABOVE,
    (MatcherName.SGBM, "both images, bottom half, 255"): _FROM_ABOVE,
    (MatcherName.SGBM, "right image, left half, 255"): _SPREADS,
    (MatcherName.SGBM, "right image, right half, 255"): _SPREADS,
}
"""What a matcher is known to get wrong. Strict: whoever mends it takes its line away."""


def admit(request: pytest.FixtureRequest, name: MatcherName, what: str) -> None:
    """Expect a test to fail, if that is a known limit of the matcher."""
    if reason := KNOWN_LIMITS.get((name, what)):
        request.applymarker(pytest.mark.xfail(reason=reason, strict=True))


def invented(disparity: np.ndarray, truth_px: float) -> float:
    """Share of all pixels that have a value more than 2 px off."""
    return float((np.abs(np.nan_to_num(disparity, nan=truth_px) - truth_px) > 2).mean())


@every_matcher
@pytest.mark.parametrize("sigma", [0.7, 1.5, 3.0])
def test_a_bare_wall_seen_by_two_noisy_sensors_gets_few_values(name: MatcherName, sigma: float) -> None:
    """Noise that the two images do not share is no texture: of a uniform wall most pixels get no value."""
    rng = np.random.default_rng(5)
    left, right = (
        np.clip(np.rint(128 + sigma * rng.standard_normal((120, 200))), 0, 255).astype(np.uint8) for _ in range(2)
    )
    disparity = create_matcher(MatchSettings(name, 64)).match(RectifiedPair(left, right))
    assert np.isnan(disparity).mean() > 0.6


@every_matcher
def test_a_bare_patch_gets_its_plane_or_nothing(name: MatcherName) -> None:
    """A uniform patch on a textured plane may be left out or take the plane's disparity, but no other."""
    pair = shifted(200, 120, 7, seed=3)
    left, right = pair.left.copy(), pair.right.copy()
    left[30:90, 60:140] = 130
    right[30:90, 53:133] = 130
    disparity = create_matcher(MatchSettings(name, 32)).match(RectifiedPair(left, right))
    assert invented(disparity[36:84, 68:132], 7) < 0.02
    assert (np.abs(disparity[4:24, 11:-4] - 7) < 0.2).mean() > 0.95


@every_matcher
@pytest.mark.parametrize("levels", [(255, 255), (0, 255), (3, 3)])
@pytest.mark.parametrize("size", [(1, 300), (300, 1), (2, 2), (17, 64), (65, 16), (290, 130)])
def test_uniform_images_of_any_size_have_no_disparity(
    name: MatcherName, size: tuple[int, int], levels: tuple[int, int]
) -> None:
    """Black, white and grey, long and flat, in as many rows as are worked on in two parts: no pixel gets a value."""
    left, right = (np.full(size, level, np.uint8) for level in levels)
    assert np.isnan(create_matcher(MatchSettings(name, 64)).match(RectifiedPair(left, right))).all()


@every_matcher
def test_constant_rows_give_the_texture_below_its_disparity_alone(name: MatcherName) -> None:
    """Rows of one level each, another one in each row, above a texture: they have no value, the texture has its own."""
    pair = shifted(160, 60, 7, seed=8)
    bands = np.repeat(noise(1, 50, seed=9), 160, axis=1)
    left, right = (np.vstack([bands, image]) for image in (pair.left, pair.right))
    disparity = create_matcher(MatchSettings(name, 32)).match(RectifiedPair(left, right))
    assert np.isnan(disparity[:46]).all()
    assert (np.abs(disparity[56:-4, 11:-4] - 7) < 0.2).mean() > 0.95


@every_matcher
@pytest.mark.parametrize("width", [1, 2, 3])
def test_hardly_any_columns_keep_the_rules(name: MatcherName, width: int) -> None:
    """An image of one to three columns gives its own shape, and no value that points out of the right image."""
    left, right = (noise(width, 70, seed) for seed in (1, 2))
    for other in (left, right):
        disparity = create_matcher(MatchSettings(name, 64)).match(RectifiedPair(left, other))
        assert disparity.shape == (70, width)
        assert not ((disparity < 0) | (disparity >= np.arange(width) + 1)).any()


@every_matcher
def test_the_pair_upside_down_has_the_same_disparity(name: MatcherName) -> None:
    """Both images upside down: what was below is above, with the same disparity."""
    far, near = shifted(160, 40, 7, seed=5), shifted(160, 40, 12, seed=6)
    left, right = np.vstack([far.left, near.left]), np.vstack([far.right, near.right])
    turned = RectifiedPair(left[::-1].copy(), right[::-1].copy())
    disparity = create_matcher(MatchSettings(name, 32)).match(turned)
    assert (np.abs(disparity[4:34, 16:-4] - 12) < 0.2).mean() > 0.95
    assert (np.abs(disparity[46:-4, 11:-4] - 7) < 0.2).mean() > 0.95


@every_matcher
def test_the_mirrored_and_exchanged_pair_has_the_same_disparity(name: MatcherName) -> None:
    """Seen in a mirror, the right camera stands on the left: with the images exchanged, every disparity stays."""
    pair = shifted(160, 80, 7, seed=5)
    mirrored = RectifiedPair(np.ascontiguousarray(pair.right[:, ::-1]), np.ascontiguousarray(pair.left[:, ::-1]))
    disparity = create_matcher(MatchSettings(name, 32)).match(mirrored)
    assert (np.abs(disparity[4:-4, 11:-4] - 7) < 0.2).mean() > 0.95


@every_matcher
def test_a_mirrored_pair_that_was_not_exchanged_gets_few_values(name: MatcherName) -> None:
    """Its true disparities are below 0, outside the search: most pixels get no value."""
    wide = noise(207, 120, seed=5)
    left, right = (np.ascontiguousarray(image[:, ::-1]) for image in (wide[:, :200], wide[:, 7:]))
    disparity = create_matcher(MatchSettings(name, 64)).match(RectifiedPair(left, right))
    assert np.isnan(disparity).mean() > 0.5


@every_matcher
@pytest.mark.parametrize("disparities", [1, 2, 64, 300])
@pytest.mark.parametrize("height", [1, 2, 7, 8, 50])
def test_one_column_has_no_disparity(name: MatcherName, height: int, disparities: int) -> None:
    """An image one pixel wide has nothing to be moved along, whatever its height and N."""
    column = noise(1, height, seed=2)
    assert np.isnan(create_matcher(MatchSettings(name, disparities)).match(RectifiedPair(column, column))).all()


@every_matcher
@pytest.mark.parametrize("width", [1, 2, 3, 15, 16, 17, 63, 64, 65, 200])
def test_one_row_keeps_the_rules(name: MatcherName, width: int) -> None:
    """An image one pixel high gives its own shape, and only values in [0, N)."""
    disparity = create_matcher(MatchSettings(name, 40)).match(shifted(width, 1, 3))
    assert disparity.shape == (1, width)
    values = disparity[~np.isnan(disparity)]
    assert ((values >= 0) & (values < 40)).all()


@every_matcher
@settings(deadline=None, max_examples=20)
@given(size=st.tuples(st.integers(1, 40), st.integers(1, 70)), seed=st.integers(0, 1000), by_px=st.integers(0, 30))
@example(size=(9, 34), seed=966, by_px=4)
def test_no_value_points_out_of_the_right_image(
    name: MatcherName, size: tuple[int, int], seed: int, by_px: int
) -> None:
    """A pixel of column x has a disparity of at most x: less than a pixel more, where it was refined."""
    height, width = size
    left = noise(width, height, seed)
    disparity = create_matcher(MatchSettings(name, 64)).match(RectifiedPair(left, np.roll(left, -by_px, axis=1)))
    assert not (disparity >= np.arange(width) + 1).any()


@every_matcher
def test_dead_rows_leave_their_neighbours_alone(name: MatcherName) -> None:
    """Where every eighth row is uniform, as a torn cable makes them, the rows between keep their disparity."""
    pair = shifted(160, 96, 7, seed=6)
    left, right = pair.left.copy(), pair.right.copy()
    left[::8] = right[::8] = 50
    disparity = create_matcher(MatchSettings(name, 32)).match(RectifiedPair(left, right))
    seen = np.delete(disparity, np.s_[::8], axis=0)[4:-4, 11:-4]
    assert (np.abs(seen - 7) < 0.5).mean() > 0.9
    assert invented(disparity[4:-4, 11:-4], 7) < 0.01


HALVES: Final[dict[str, tuple[Any, Any, Any]]] = {
    "left half": (np.s_[:, :120], np.s_[6:-6, 6:106], np.s_[6:-6, 132:-6]),
    "right half": (np.s_[:, 120:], np.s_[6:-6, 134:-6], np.s_[6:-6, 12:106]),
    "top half": (np.s_[:60], np.s_[6:50, 12:-6], np.s_[70:-6, 12:-6]),
    "bottom half": (np.s_[60:], np.s_[70:-6, 12:-6], np.s_[6:50, 12:-6]),
}
"""Of a 240x120 image: what is saturated, the inside of that, and the inside of the rest."""


@every_matcher
@pytest.mark.parametrize("level", [0, 255])
@pytest.mark.parametrize("half", HALVES)
@pytest.mark.parametrize("which", ["both images", "right image", "left image"])
def test_a_saturated_half_gets_no_invented_values_and_spares_the_other(
    request: pytest.FixtureRequest, name: MatcherName, which: str, half: str, level: int
) -> None:
    """Half of the image white, or black: the rest keeps its disparity. White in both images is bare; in one image it matches nothing."""
    admit(request, name, f"{which}, {half}, {level}")
    pair = shifted(240, 120, 7, seed=7)
    left, right = pair.left.copy(), pair.right.copy()
    saturated, inside, rest = HALVES[half]
    # The scene's half, not the sensor's: at the vertical border the right image shows it 7 px further left.
    moved = np.zeros((120, 247), np.bool_)
    moved[:, :240][saturated] = True
    moved[:, 240:] = moved[:, 239:240]
    if which != "left image":
        right[moved[:, 7:]] = level
    if which != "right image":
        left[moved[:, :240]] = level
    disparity = create_matcher(MatchSettings(name, 32)).match(RectifiedPair(left, right))
    assert (np.abs(disparity[rest] - 7) < 0.5).mean() > 0.95
    if which == "both images":
        assert invented(disparity[inside], 7) < 0.05
    else:
        assert np.isnan(disparity[inside]).mean() > 0.4


def views(pair: RectifiedPair) -> dict[str, RectifiedPair]:
    """The same pixels with other strides."""
    left, right = pair.left, pair.right

    def each(view: Callable[[np.ndarray], np.ndarray]) -> RectifiedPair:
        return RectifiedPair(view(left), view(right))

    return {
        "Fortran order": each(np.asfortranarray),
        "every second row": each(lambda image: np.repeat(image, 2, axis=0)[::2]),
        "every third column": each(lambda image: np.repeat(image, 3, axis=1)[:, ::3]),
        "rows backwards": each(lambda image: image[::-1].copy()[::-1]),
        "columns backwards": each(lambda image: image[:, ::-1].copy()[:, ::-1]),
        "both backwards, in steps": each(
            lambda image: np.kron(image[::-1, ::-1], np.ones((2, 2), np.uint8))[::-2, ::-2]
        ),
        "one channel of three": each(lambda image: np.dstack([image, 255 - image, image // 2])[..., 0]),
        "a window": each(lambda image: np.pad(image, 9, constant_values=77)[9:-9, 9:-9]),
        "unlike": RectifiedPair(np.asfortranarray(left), right[:, ::-1].copy()[:, ::-1]),
    }


@every_matcher
def test_strides_do_not_matter(name: MatcherName) -> None:
    """Views with any strides, negative ones, too, give the same bits as plain arrays, and are not written to."""
    pair = plane(width_px=150, height_px=70, seed=10).pair
    matcher = create_matcher(MatchSettings(name, 48))
    expected = matcher.match(pair).tobytes()
    for what, view in views(pair).items():
        assert (view.left == pair.left).all(), what
        assert matcher.match(view).tobytes() == expected, what
        assert (view.left == pair.left).all(), what
        assert (view.right == pair.right).all(), what


@every_matcher
def test_strides_of_colours_do_not_matter(name: MatcherName) -> None:
    """A colour image read backwards along its channels, a window and a Fortran array give the same bits as plain arrays."""
    rng = np.random.default_rng(3)
    wide = np.asarray(cv2.blur(rng.integers(0, 256, (60, 127, 3), dtype=np.uint8), (3, 3)), np.uint8)
    pair = RectifiedPair(wide[:, :120].copy(), wide[:, 7:].copy())
    matcher = create_matcher(MatchSettings(name, 32))
    expected = matcher.match(pair).tobytes()
    backwards = RectifiedPair(pair.left[..., ::-1].copy()[..., ::-1], pair.right[..., ::-1].copy()[..., ::-1])
    for view in (
        backwards,
        RectifiedPair(wide[:, :120], wide[:, 7:]),
        RectifiedPair(np.asfortranarray(pair.left), pair.right),
    ):
        assert matcher.match(view).tobytes() == expected


@every_matcher
def test_overlapping_rows_are_read_as_they_are(name: MatcherName) -> None:
    """Rows that share memory (one line repeated, a window that slides over it, grey or in colour) match as their copies do."""
    line = noise(400, 1, 3)[0]
    sliding = np.lib.stride_tricks.sliding_window_view(line, 200)[:60]
    same = np.broadcast_to(line[:200], (60, 200))
    coloured = np.broadcast_to(noise(200, 3, 4).T, (60, 200, 3))
    matcher = create_matcher(MatchSettings(name, 32))
    for view in (sliding, same, sliding[::-1], coloured):
        right = np.roll(view, -5, axis=1)
        expected = matcher.match(RectifiedPair(view.copy(), right)).tobytes()
        assert matcher.match(RectifiedPair(view, right)).tobytes() == expected


@every_matcher
def test_hostile_pairs_leave_no_trace(name: MatcherName) -> None:
    """After saturated, tiny, wide and refused pairs, colour and grey, a matcher gives the same bits as a fresh one."""
    pair = plane(seed=11).pair
    used = create_matcher(MatchSettings(name, 48))
    white = np.full((90, 333), 255, np.uint8)
    for other in (white, white[:1], white[:, :1], noise(700, 3, 1), np.repeat(noise(64, 64, 2)[..., None], 3, axis=2)):
        used.match(RectifiedPair(other, other))
    with pytest.raises(DataError):
        used.match(RectifiedPair(white, white[1:]))
    assert used.match(pair).tobytes() == create_matcher(MatchSettings(name, 48)).match(pair).tobytes()


def same(image: Image) -> RectifiedPair:
    """Both cameras see the same."""
    return RectifiedPair(image, image.copy())


HARD: Final[dict[str, Callable[[], RectifiedPair]]] = {
    "uniform": lambda: RectifiedPair(np.full((40, 60), 9, np.uint8), np.full((40, 60), 200, np.uint8)),
    "one column": lambda: RectifiedPair(noise(1, 40, 1), noise(1, 40, 2)),
    "constant rows": lambda: same(np.repeat(noise(1, 40, 3), 60, axis=1)),
    "half white": lambda: same(np.hstack([noise(40, 40, 4), np.full((40, 40), 255, np.uint8)])),
    "unrelated": lambda: RectifiedPair(noise(90, 60, 5), noise(90, 60, 6)),
    "textured": lambda: shifted(120, 60, 7),
}
"""Pairs by what is hard about them."""


@every_matcher
@pytest.mark.parametrize("what", HARD)
def test_whoever_tells_confidence_tells_it_where_there_is_a_value(name: MatcherName, what: str) -> None:
    """Confidence has the image's size, is uint8, and is 0 just where there is no value; the disparity is that of `match`."""
    matcher = create_matcher(MatchSettings(name, 32))
    if not isinstance(matcher, ReportingMatcher):
        pytest.skip(f"{name.value} tells no confidence")
    pair = HARD[what]()
    found = matcher.matched(pair)
    assert found.disparity.tobytes() == matcher.match(pair).tobytes()
    if found.confidence is None:
        pytest.skip(f"{name.value} tells no confidence")
    assert found.confidence.dtype == np.uint8
    assert found.confidence.shape == pair.left.shape[:2]
    assert ((found.confidence > 0) == np.isfinite(found.disparity)).all()


@every_matcher
def test_results_are_their_own(name: MatcherName) -> None:
    """A result that was handed out does not change when the next pair is matched, and may be written to."""
    matcher = create_matcher(MatchSettings(name, 48))
    first = matcher.match(plane(seed=13).pair)
    before = first.tobytes()
    matcher.match(plane(seed=14).pair)
    assert first.tobytes() == before
    first[:] = 0
