"""Searching where the last pair found something: no ghosts, whatever comes next, and the full search whenever the images ask for it."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.model import Disparity, Matched, RectifiedPair, SearchedAs, TemporalAccount
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_elsewhere import Range, fits_elsewhere
from phone_host.stereo.match_temporal import DUE_EVERY, TemporalMatcher, range_of
from phone_host.stereo.matcher_names import MatcherName, matcher_named
from phone_host.stereo.matcher_protocol import matched_by
from tests.support.layers import Layer, Layers, layers
from tests.support.planes import noise

N = 128
_WALL = Layer(disparity=24, seed=1)
_BOX = Layer(disparity=34, x=140, y=80, width=80, height=80, seed=2)
_NEAR_BOX = Layer(disparity=100, x=180, y=80, width=50, height=50, seed=2)
_POLE = Layer(disparity=90, x=200, y=0, width=10, height=240, seed=3)
_NEW_WALL = Layer(disparity=80, seed=4)

both_matchers = pytest.mark.parametrize("name", [MatcherName.SGBM, MatcherName.TANDEM], ids=lambda name: name.value)


def temporal(name: MatcherName = MatcherName.TANDEM, disparities: int = N) -> TemporalMatcher:
    """A new stream."""
    matcher = create_matcher(MatchSettings(name, disparities, temporal=True))
    assert isinstance(matcher, TemporalMatcher)
    return matcher


def full(name: MatcherName, scene: Layers, disparities: int = N) -> Disparity:
    """The full search of one pair alone."""
    return create_matcher(MatchSettings(name, disparities)).match(scene.pair)


def why(matched: Matched) -> SearchedAs:
    """How a pair was searched."""
    assert matched.report.searched is not None
    return matched.report.searched.why


def wrong(disparity: Disparity, scene: Layers) -> float:
    """Share of the pixels that both cameras see whose value is missing or off by more than 1 px."""
    off = ~(np.abs(disparity - scene.disparity) <= 1)
    return float(off[scene.visible].mean())


def same(one: Disparity, other: Disparity) -> float:
    """Share of the pixels with a value in either that agree within 1/16 px."""
    valued = np.isfinite(one) | np.isfinite(other)
    return float((np.abs(one - other) <= 1 / 16)[valued].mean())


def follow(name: MatcherName, scenes: Sequence[Layers]) -> list[Matched]:
    """Match a stream."""
    matcher = temporal(name)
    return [matcher.matched(scene.pair) for scene in scenes]


@both_matchers
def test_a_still_scene_is_narrowed_and_agrees_with_the_full_search(name: MatcherName) -> None:
    """After the first pair less than half is searched; 98 % of the values lie within 1/16 px of the full search, in its own noise."""
    scenes = [layers([_BOX, _WALL], sensor_seed=seed) for seed in range(3)]
    first, *others = follow(name, scenes)
    assert why(first) is SearchedAs.FIRST
    assert first.disparity.tobytes() == full(name, scenes[0]).tobytes()
    for matched, scene in zip(others, scenes[1:], strict=True):
        assert why(matched) is SearchedAs.NARROWED
        assert matched.report.searched is not None
        assert matched.report.searched.share < 0.5
        assert same(matched.disparity, full(name, scene)) > 0.98
        assert wrong(matched.disparity, scene) < wrong(full(name, scene), scene) + 0.002


@both_matchers
@pytest.mark.parametrize(
    ("before", "after"),
    [
        pytest.param([_BOX, _WALL], [_NEAR_BOX, _WALL], id="an object jumps nearer"),
        pytest.param([_BOX, _WALL], [_POLE, _BOX, _WALL], id="a pole of 10 px appears"),
        pytest.param([_BOX, _WALL], [_NEW_WALL], id="cut to a near scene"),
        pytest.param([_NEW_WALL], [_BOX, _WALL], id="cut to a far scene"),
    ],
)
def test_what_appears_outside_the_range_is_found_at_once(
    name: MatcherName, before: Sequence[Layer], after: Sequence[Layer]
) -> None:
    """The new images ask for the full search themselves: the pair has the bits of a stream that begins with it."""
    scenes = [layers(before), layers(before, sensor_seed=1), layers(after, sensor_seed=2)]
    _, narrowed, surprised = follow(name, scenes)
    assert why(narrowed) is SearchedAs.NARROWED
    assert why(surprised) is SearchedAs.ELSEWHERE
    assert surprised.disparity.tobytes() == full(name, scenes[2]).tobytes()


@both_matchers
def test_a_moved_camera_leaves_no_ghost(name: MatcherName) -> None:
    """Everything moves sideways by 20 px and nearer by 5 px of disparity: no value stays where it was."""
    moved = [
        Layer(disparity=39, x=160, y=90, width=80, height=80, seed=2),
        Layer(disparity=29, seed=7),
    ]
    scenes = [layers([_BOX, _WALL]), layers([_BOX, _WALL], sensor_seed=1), layers(moved, sensor_seed=2)]
    matched = follow(name, scenes)[-1]
    assert same(matched.disparity, full(name, scenes[-1])) > 0.98
    assert wrong(matched.disparity, scenes[-1]) < wrong(full(name, scenes[-1]), scenes[-1]) + 0.002


@both_matchers
def test_what_comes_nearer_slowly_is_followed(name: MatcherName) -> None:
    """A box that grows by 6 px of disparity a pair, from 34 to 82 px, never gets fewer right values than from the full search."""
    for step, matched in enumerate(follow(name, scenes := [_approaching(step) for step in range(9)])):
        scene = scenes[step]
        assert wrong(matched.disparity, scene) < wrong(full(name, scene), scene) + 0.005


def _approaching(step: int) -> Layers:
    near = Layer(disparity=34 + 6 * step, x=150, y=80, width=80, height=80, seed=2)
    return layers([near, _WALL], sensor_seed=step)


def test_a_pair_without_texture_gets_nothing_from_the_one_before() -> None:
    """Two uniform images have no value at all, even right after a rich pair; the pair after them is searched in full."""
    scene = layers([_BOX, _WALL])
    matcher = temporal()
    matcher.match(scene.pair)
    bare = np.full(scene.disparity.shape, 90, np.uint8)
    assert np.isnan(matcher.match(RectifiedPair(bare, bare))).all()
    again = matcher.matched(scene.pair)
    assert why(again) is SearchedAs.EMPTY
    assert again.disparity.tobytes() == full(MatcherName.TANDEM, scene).tobytes()


def test_images_of_another_size_begin_anew() -> None:
    """The first pair of each size is searched in full and has the bits of a new stream."""
    matcher = temporal()
    matcher.match(layers([_BOX, _WALL]).pair)
    other = layers([_WALL], width_px=256, height_px=180)
    matched = matcher.matched(other.pair)
    assert why(matched) is SearchedAs.FIRST
    assert matched.disparity.tobytes() == full(MatcherName.TANDEM, other).tobytes()


def test_one_pair_in_thirty_is_searched_in_full() -> None:
    """What is too small to be seen in a narrowed search stays unseen for 29 pairs at most."""
    matcher = temporal(MatcherName.TANDEM)
    scene = layers([_WALL], width_px=160, height_px=60)
    found = [why(matcher.matched(scene.pair)) for _ in range(2 * DUE_EVERY)]
    assert [at for at, item in enumerate(found) if item is not SearchedAs.NARROWED] == [0, DUE_EVERY]
    assert found[DUE_EVERY] is SearchedAs.DUE


def test_a_scene_that_fills_the_range_is_searched_in_full() -> None:
    """Disparities from 6 to 110 of 128 leave nothing to save."""
    scene = layers([Layer(disparity=110, x=200, y=40, width=100, height=150, seed=2), Layer(disparity=6)])
    assert [why(item) for item in follow(MatcherName.TANDEM, [scene, scene])] == [SearchedAs.FIRST, SearchedAs.WIDE]


def test_columns_whose_partners_lie_outside_the_right_image_have_no_value() -> None:
    """A narrowed search from d = 16 on leaves the first 16 columns empty, and confidence is 0 just where there is no value."""
    scene = layers([_BOX, _WALL])
    matched = follow(MatcherName.TANDEM, [scene, scene])[1]
    assert np.isnan(matched.disparity[:, :16]).all()
    assert matched.confidence is not None
    assert ((matched.confidence == 0) == np.isnan(matched.disparity)).all()


@settings(deadline=None, max_examples=12)
@given(
    sizes=st.lists(st.tuples(st.integers(1, 40), st.integers(1, 70)), min_size=2, max_size=4),
    disparities=st.integers(1, 130),
    by=st.integers(0, 20),
)
def test_any_pairs_in_any_order_keep_the_rules_of_matchers(
    sizes: list[tuple[int, int]], disparities: int, by: int
) -> None:
    """Size and type are those of the left image, values lie in [0, N), whatever came before."""
    matcher = temporal(MatcherName.TANDEM, disparities)
    for height, width in [*sizes, sizes[-1], sizes[-1]]:
        disparity = matcher.match(RectifiedPair(noise(width, height, 1), np.roll(noise(width, height, 1), -by, axis=1)))
        assert disparity.shape == (height, width)
        assert disparity.dtype == np.float32
        values = disparity[np.isfinite(disparity)]
        assert ((values >= 0) & (values < disparities)).all()


def test_plain_and_repeated_patterns_ask_for_no_other_range() -> None:
    """A uniform pair, and vertical stripes of 12 px that lie 30 px apart, fit everywhere alike, so nothing fits better outside."""
    inside = Range(low_px=16, high_px=48)
    bare = np.full((200, 320), 90, np.uint8)
    assert not fits_elsewhere(bare, bare, inside, N)
    stripes = np.tile(np.where(np.arange(350) // 6 % 2, 200, 60).astype(np.uint8), (200, 1))
    assert not fits_elsewhere(stripes[:, :320], stripes[:, 30:], inside, N)


def test_a_range_holds_all_values_but_a_few_and_a_margin() -> None:
    """Values 30 and 60 with 5 strays of 20,000: 22 up to a multiple of 16 beyond 69; strays alone give no range."""
    disparity = np.full((100, 200), np.nan, np.float32)
    disparity[:50], disparity[50:] = 30, 60
    disparity[0, :3] = 120
    found = range_of(disparity, 128)
    assert found is not None
    assert (found.low_px, found.high_px) == (22, 70)
    only_strays = np.full((100, 200), np.nan, np.float32)
    only_strays[0, :5] = 50
    assert range_of(only_strays, 128) is None


def test_networks_are_refused_because_they_search_no_range() -> None:
    """The option would do nothing for them."""
    with pytest.raises(SettingsError, match="network"):
        create_matcher(MatchSettings(matcher_named("onnx:net.onnx"), 64, temporal=True))


def test_without_the_option_a_pair_does_not_depend_on_the_one_before() -> None:
    """The same bits before and after another scene, and no word of a narrowed search."""
    matcher = create_matcher(MatchSettings(MatcherName.TANDEM, N))
    scene = layers([_BOX, _WALL])
    first = matched_by(matcher, scene.pair)
    matcher.match(layers([_NEW_WALL]).pair)
    assert matched_by(matcher, scene.pair).disparity.tobytes() == first.disparity.tobytes()
    assert first.report.searched is None


def test_the_account_adds_up() -> None:
    """Two narrowed to a quarter and one in full: 3 pairs, 2 narrowed, half of the disparities on average."""
    account = TemporalAccount()
    scene = layers([_BOX, _WALL])
    for item in follow(MatcherName.TANDEM, [scene, scene, scene]):
        assert item.report.searched is not None
        account = account.plus(item.report.searched)
    assert (account.pairs, account.narrowed, account.of(SearchedAs.FIRST)) == (3, 2, 1)
    share = follow(MatcherName.TANDEM, [scene, scene])[1].report.searched
    assert share is not None
    assert account.share == pytest.approx((1 + 2 * share.share) / 3)
