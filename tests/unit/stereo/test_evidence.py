"""Mistakes made on a rendered pair are named rightly; good pairs, also behind a rig, raise no doubt."""

import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
import pytest

from common import now
from common.ledger import StageTimes
from phone_host.diagnostics.codes import BLOCKING, Code
from phone_host.diagnostics.headline import Grade
from phone_host.diagnostics.image_rules import image_doubts
from phone_host.model import (
    Arrangement,
    CameraModel,
    Crop,
    CutCounts,
    DepthLimits,
    Epipolar,
    Evidence,
    Image,
    Processed,
    RectifiedPair,
    Rig,
    Side,
    StereoGeometry,
)
from phone_host.report import depth_data
from phone_host.run.stereo_remarks import judge_pair
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import Look, rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.evidence import density, has_depth, look_at, maps_of
from phone_host.stereo.evidence_points import ThroughRig, Unmoved, turned_back
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.support.rigs import points_seen_by_both, stacked_rig, unlike_rig

Pair = tuple[Image, Image]

SGBM: Final = create_matcher(MatchSettings(MatcherName.SGBM, 48))
FLAT: Final = StereoCore(SGBM)


def _rig(turn: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Rig:
    """Two cameras of 320x240, f = 260 px, 100 mm apart, the right one turned by a rotation vector, rad."""
    models = [
        CameraModel(
            width_px=320,
            height_px=240,
            matrix=np.array([[260.0, 0, 159.5 + off], [0, 260.0, 119.5 - off], [0, 0, 1]]),
            distortion=np.array([lens, 0.02, 0, 0, 0]) * any(turn),
        )
        for off, lens in ((0.0, -0.1), (4.0 * any(turn), -0.18))
    ]
    rotation = np.asarray(cv2.Rodrigues(np.array(turn))[0], np.float64)
    centre = rotation @ np.array([0.1, 0.0, 0.0])
    return Rig(left=models[0], right=models[1], R_right_left=rotation, t_right_left_m=-centre)


def _render(rig: Rig) -> Pair:
    poses, looks = (
        rig_poses(rig),
        (Look(noise_sigma=1.0, seed=1), Look(noise_sigma=1.5, gain_bgr=(0.9, 0.9, 0.9), seed=2)),
    )
    left, right = (
        render(demo_scene(), model, pose, look)
        for model, pose, look in zip((rig.left, rig.right), poses, looks, strict=True)
    )
    return left, right


@pytest.fixture(scope="module")
def good() -> Pair:
    """A rectified pair of the demo's scene."""
    return _render(_rig())


@pytest.fixture(scope="module")
def turned_rig() -> Rig:
    """Unlike lenses, and a right camera that looks 1.2 degrees aside, down and rolled."""
    return _rig((0.02, -0.02, 0.02))


@pytest.fixture(scope="module")
def raw(turned_rig: Rig) -> Pair:
    """What that rig sees."""
    return _render(turned_rig)


def _evidence(core: StereoCore, left: Image, right: Image) -> Evidence:
    processed = core.compute(left, right, now.monotonic_ns)
    return look_at(processed, maps_of(core, processed)).evidence


def _doubts(core: StereoCore, left: Image, right: Image) -> list[str]:
    return [concern.code for concern in image_doubts(_evidence(core, left, right))]


def _turn(image: Image, code: int) -> Image:
    return np.asarray(cv2.rotate(image, code), np.uint8)


def _flip(image: Image, axis: int) -> Image:
    return np.asarray(cv2.flip(image, axis), np.uint8)


def _square(image: Image) -> Image:
    return image[:, 40:280].copy()


def _blur(image: Image) -> Image:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 3.0), np.uint8)


def _noise(image: Image, level: float, seed: int) -> Image:
    return np.clip(np.random.default_rng(seed).normal(level, 2.0, image.shape), 0, 255).astype(np.uint8)


def _dark(image: Image) -> Image:
    return np.asarray(image * 0.08, np.uint8)


def _both(change: Callable[[Image], Image]) -> Callable[[Image, Image], Pair]:
    return lambda left, right: (change(left), change(right))


HALF, QUARTER = cv2.ROTATE_180, cv2.ROTATE_90_CLOCKWISE
MISTAKES: Final[dict[str, tuple[Code, Callable[[Image, Image], Pair]]]] = {
    "swapped": (Code.SWAPPED, lambda left, right: (right, left)),
    "right on its head": (Code.TURNED, lambda left, right: (left, _turn(right, HALF))),
    "left on its head": (Code.TURNED, lambda left, right: (_turn(left, HALF), right)),
    "right turned by a quarter": (Code.TURNED_BY_QUARTER, lambda a, b: (_square(a), _turn(_square(b), QUARTER))),
    "left turned by a quarter": (Code.TURNED_BY_QUARTER, lambda a, b: (_turn(_square(a), QUARTER), _square(b))),
    "both turned by a quarter": (Code.TURNED_BY_QUARTER, _both(lambda image: _turn(_square(image), QUARTER))),
    "right mirrored": (Code.MIRRORED, lambda left, right: (left, _flip(right, 1))),
    "left mirrored top to bottom": (Code.MIRRORED, lambda left, right: (_flip(left, 0), right)),
    "same image": (Code.SAME_IMAGE, lambda left, _: (left, left)),
    "same image, darker and blurred": (
        Code.SAME_IMAGE,
        lambda left, _: (left, np.asarray(cv2.GaussianBlur(left * 0.8, (0, 0), 0.6), np.uint8)),
    ),
    "right covered": (Code.COVERED, lambda left, right: (left, _noise(right, 3, 1))),
    "left covered by a finger": (Code.COVERED, lambda left, right: (_noise(left, 80, 1), right)),
    "both covered": (Code.COVERED, lambda left, right: (_noise(left, 3, 1), _noise(right, 3, 2))),
    "right dark": (Code.DARK, lambda left, right: (left, _dark(right))),
    "both dark": (Code.DARK, _both(_dark)),
    "left unfocused": (Code.UNFOCUSED, lambda left, right: (_blur(left), right)),
    "both unfocused": (Code.UNFOCUSED, _both(_blur)),
    "another scene": (Code.OTHER_SCENE, lambda left, right: (left, _texture(right.shape))),
}


def _texture(shape: tuple[int, ...]) -> Image:
    noise = cv2.GaussianBlur(np.random.default_rng(4).normal(size=shape), (0, 0), 2.0)
    return np.asarray(np.clip(128 + noise / noise.std() * 40, 0, 255), np.uint8)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_and_no_other_one(good: Pair, mistake: str) -> None:
    """The first doubt is the mistake's own; no blocking doubt stands beside it."""
    doubt, change = MISTAKES[mistake]
    found = _doubts(FLAT, *change(*good))
    assert found[:1] == [doubt]
    assert not [other for other in found[1:] if other in BLOCKING]


def test_a_good_pair_raises_no_doubt(good: Pair) -> None:
    """Figures are those of geometry: rows agree, and the median disparity is that of the scene, 0.7 to 2.5 m away at f b = 26 m px."""
    evidence = _evidence(FLAT, *good)
    assert image_doubts(evidence) == ()
    assert evidence.density > 0.7
    assert evidence.consistency > 0.6
    assert evidence.vertical_px < 0.3
    assert 26 / 2.5 <= evidence.disparity_px <= 26 / 0.7


@pytest.mark.parametrize("lower_px", [-1.5, 1.5, 4.0])
def test_the_vertical_error_is_measured(good: Pair, lower_px: float) -> None:
    """A right image that lies too low is told with its sign and size; 4 px are a doubt, 1.5 px are not."""
    move = np.array([[1, 0, 0], [0, 1, lower_px]])
    lower = np.asarray(cv2.warpAffine(good[1], move, (320, 240), borderMode=cv2.BORDER_REPLICATE), np.uint8)
    evidence = _evidence(FLAT, good[0], lower)
    assert evidence.vertical_offset_px == pytest.approx(lower_px, abs=0.15)
    assert evidence.vertical_px == pytest.approx(abs(lower_px), abs=0.15)
    doubts = [concern.code for concern in image_doubts(evidence)]
    assert (Code.VERTICAL_ERROR in doubts) == (abs(lower_px) > 2)
    assert not BLOCKING & set(doubts)


def test_behind_a_rig_mistakes_are_made_in_the_cameras_own_images(turned_rig: Rig, raw: Pair) -> None:
    """Through a rig of unlike, turned cameras the good pair raises no doubt, and each mistake has its name; both on their heads and both mirrored are told from swapped ones."""
    core = StereoCore(SGBM, Rectifier(turned_rig))
    left, right = raw
    assert _doubts(core, left, right) == []
    assert _doubts(core, right, left)[0] is Code.SWAPPED
    assert _doubts(core, left, left)[0] is Code.SAME_IMAGE
    assert _doubts(core, left, _turn(right, HALF))[0] is Code.TURNED
    assert _doubts(core, _turn(left, HALF), _turn(right, HALF))[0] is Code.TURNED
    assert _doubts(core, _flip(left, 1), _flip(right, 1))[0] is Code.MIRRORED
    assert _doubts(core, left, _flip(right, 1))[0] is Code.MIRRORED


def test_points_go_to_the_cameras_image_and_back() -> None:
    """Points that both cameras see keep their place to 0.01 px on the way to the own image and back, and share a row."""
    rig = unlike_rig()
    core = StereoCore(SGBM, Rectifier(rig))
    assert core.rectification is not None
    maps = ThroughRig(rig, core.rectification)
    seen = points_seen_by_both(rig, 200, seed=3)
    rows = []
    for side, own in ((Side.LEFT, seen.left_px), (Side.RIGHT, seen.right_px)):
        rectified = maps.rectified(own, side)
        assert np.abs(maps.own(rectified, side) - own).max() < 0.01
        rows.append(rectified[:, 1])
    assert np.abs(rows[0] - rows[1]).max() < 0.01


def test_a_turn_goes_about_the_middle_of_the_image() -> None:
    """The corner of an image that was turned clockwise comes back to its own corner."""
    image = np.zeros((30, 30), np.uint8)
    image[2, 27] = 1
    for quarters, code in ((1, cv2.ROTATE_90_CLOCKWISE), (2, cv2.ROTATE_180), (3, cv2.ROTATE_90_COUNTERCLOCKWISE)):
        y, x = np.argwhere(cv2.rotate(image, code))[0]
        assert turned_back(np.array([[x, y]], np.float64), (30, 30), quarters).tolist() == [[27.0, 2.0]]


def test_without_a_rig_only_brightness_is_judged(good: Pair) -> None:
    """Pairs of a run without calibration are not accused of any arrangement, but a covered camera is named."""
    swapped = Processed(RectifiedPair(good[1], good[0]), None, None, StageTimes())
    assert image_doubts(look_at(swapped, None).evidence) == ()
    blind = replace(swapped, pair=RectifiedPair(good[0], _noise(good[1], 3, 1)))
    assert [concern.code for concern in image_doubts(look_at(blind, None).evidence)] == [Code.COVERED]


def test_images_without_anything_in_them_are_measured_too() -> None:
    """Plain images of one level, and images of a few pixels or one, give evidence without any feature and no accusation but of blindness."""
    for size in ((240, 320), (16, 9), (1, 40), (1, 1)):
        plain = np.full((*size, 3), 128, np.uint8)
        evidence = _evidence(FLAT, plain, plain)
        assert max(support.features for support in evidence.supports) == 0
        assert not [concern for concern in image_doubts(evidence) if concern.code in BLOCKING]


def test_depth_is_what_is_left_after_the_cut() -> None:
    """A pair has depth if a pixel was kept; without cuts, if a disparity is known."""
    pair = RectifiedPair(np.zeros((4, 4), np.uint8), np.zeros((4, 4), np.uint8))
    some = np.full((4, 4), 3.0, np.float32)
    known = Processed(pair, some, None, StageTimes())
    assert has_depth(known)
    assert not has_depth(replace(known, disparity=some * np.float32(np.nan)))
    assert not has_depth(replace(known, cut=CutCounts(kept=0, too_far=16)))
    assert not has_depth(Processed(pair, None, None, StageTimes()))
    # A plain wall is matched by chance at 2 pixels of 1000; a small thing amid what the user cut away is depth.
    assert not has_depth(replace(known, cut=CutCounts(kept=2, unmatched=998)))
    assert has_depth(replace(known, cut=CutCounts(kept=2, unmatched=500, too_far=498)))


def test_specks_are_told_from_surfaces(good: Pair) -> None:
    """Half the depth of a good pair strewn as 8 x 8 px pieces at unlike disparities: about half is scattered; of the pair as it is, little."""
    core = FLAT
    processed = core.compute(*good, now.monotonic_ns)
    disparity = np.asarray(processed.disparity).copy()
    assert look_at(processed, maps_of(core, processed)).evidence.scattered_share < 0.09
    height, width = disparity.shape
    random = np.random.default_rng(5)
    specks = np.kron(random.uniform(2, 40, (height // 16, width // 8)), np.ones((8, 8))).astype(np.float32)
    disparity[: specks.shape[0], : specks.shape[1]] = specks
    strewn = replace(processed, disparity=disparity, cloud=None, cut=None)
    assert look_at(strewn, maps_of(core, strewn)).evidence.scattered_share == pytest.approx(0.5, abs=0.1)


def test_a_doffs_of_other_images_is_told(good: Pair) -> None:
    """With the sign of doffs turned, most points would lie behind infinity; with 0 none does, and nothing is said."""
    for doffs_px, told in ((-20.0, True), (0.0, False)):
        geometry = StereoGeometry(focal_px=260.0, baseline_m=0.1, cx_px=159.5, cy_px=119.5, doffs_px=doffs_px)
        core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 64)), geometry=geometry)
        found = image_doubts(_evidence(core, *good))
        assert [concern.code for concern in found] == ([Code.GEOMETRY] if told else [])


def test_a_principal_point_of_other_images_is_told(good: Pair) -> None:
    """35,119 of 320x240 px lies at an eleventh of the width: told live and of files alike, once, though doffs is doubtful too. A rig's own is not looked at."""
    for cx_px, doffs_px, told in ((159.5, 0.0, False), (35.0, 0.0, True), (35.0, -20.0, True)):
        geometry = StereoGeometry(focal_px=260.0, baseline_m=0.1, cx_px=cx_px, cy_px=119.5, doffs_px=doffs_px)
        core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 64)), geometry=geometry)
        processed = core.compute(*good, lambda: 0)
        live = image_doubts(look_at(processed, maps_of(core, processed)).evidence)
        assert live == judge_pair(core, processed).concerns
        said = [concern for concern in live if "the principal point 35,120 lies far" in concern.message]
        assert [concern.code for concern in said] == ([Code.GEOMETRY] if told else [])
        assert len(live) == len(said)
        rig = look_at(processed, ThroughRig(_rig(), Rectifier(_rig()).rectification)).evidence
        assert rig.off_middle is None


def test_the_middle_of_the_scene_is_that_of_what_is_kept() -> None:
    """Left half 40 px, right half 10 px, and everything farther than 1 m cut away (f b = 26 px m): the middle is 40 px."""
    disparity = np.full((60, 80), 10.0, np.float32)
    disparity[:, :30] = 40.0
    pair = RectifiedPair(np.zeros((60, 80), np.uint8), np.zeros((60, 80), np.uint8))
    geometry = StereoGeometry(focal_px=260.0, baseline_m=0.1, cx_px=39.5, cy_px=29.5)
    limits = DepthLimits(near_m=0.0, far_m=1.0, disparity_error_px=0.25, from_rig=False)
    for given, middle in ((None, 10.0), (limits, 40.0)):
        processed = Processed(pair, disparity, None, StageTimes(), geometry=geometry, limits=given)
        assert look_at(processed, Unmoved(80, 60)).evidence.disparity_px == middle


def test_a_crop_raises_no_doubt(good: Pair) -> None:
    """Density is the share of the pixels inside the crop: 120x80 of 320x240 px are an eighth of the image, and yet as dense as all of it."""
    geometry = StereoGeometry(focal_px=260.0, baseline_m=0.1, cx_px=159.5, cy_px=119.5)
    wanted = DepthWanted(crop=Crop(x_px=100, y_px=80, width_px=120, height_px=80))
    core = StereoCore(MatchSettings(MatcherName.SGBM, 48), geometry=geometry, wanted=wanted)
    processed = core.compute(*good, lambda: 0)
    assert processed.disparity is not None
    known = int(np.isfinite(processed.disparity).sum())
    assert density(processed) == pytest.approx(known / (120 * 80))
    assert density(replace(processed, cut=None)) == pytest.approx(known / (320 * 240))
    assert density(replace(processed, disparity=None)) == 0
    trust = judge_pair(core, processed)
    assert trust.concerns == ()
    assert trust.figures.density > 0.7
    assert trust.figures.consistency > 0.6
    assert depth_data.density(processed) == pytest.approx(trust.figures.density, abs=0.05)


@pytest.mark.parametrize("epipolar", [Epipolar.UP, Epipolar.DOWN])
def test_stacked_cameras_are_judged_along_their_columns(epipolar: Epipolar) -> None:
    """A good pair of cameras one above the other has no doubt, and is not taken for an exchanged one, whichever is above; its columns agree to a fraction of a pixel."""
    rig = stacked_rig(epipolar)
    core = StereoCore(SGBM, Rectifier(rig))
    processed = core.compute(*_render(rig), lambda: 0)
    assert processed.pair.epipolar is epipolar
    trust = judge_pair(core, processed)
    assert trust.concerns == ()
    assert trust.answer.grade is Grade.GOOD
    assert trust.figures.vertical_px < 1
    assert trust.figures.density > 0.5
    evidence = look_at(processed, maps_of(core, processed)).evidence
    features = {support.arrangement: support.features for support in evidence.supports}
    assert features[Arrangement.RIGHT] > 50 > features[Arrangement.SWAPPED]


@pytest.mark.parametrize("epipolar", [Epipolar.UP, Epipolar.DOWN])
def test_exchanged_stacked_cameras_are_named(epipolar: Epipolar) -> None:
    """Upper and lower images exchanged are as wrong as left and right ones."""
    rig = stacked_rig(epipolar)
    assert _doubts(StereoCore(SGBM, Rectifier(rig)), *_render(rig)[::-1])[0] is Code.SWAPPED


def test_evidence_of_a_photograph_takes_less_memory_than_its_disparities() -> None:
    """Of 12 megapixels, 48 MB of disparities, a regular sample is looked at, not the places of all, 192 MB."""
    image = np.tile(_texture((300, 400)), (10, 10))
    disparity = np.full(image.shape, 8.0, np.float32)
    processed = Processed(RectifiedPair(image, np.roll(image, -8, axis=1)), disparity, None, StageTimes())
    tracemalloc.start()
    try:
        evidence = look_at(processed, Unmoved(4000, 3000)).evidence
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < disparity.nbytes
    assert evidence.consistency > 0.6


def test_every_arrangement_is_counted_once(good: Pair) -> None:
    """The supports name each arrangement once; most features of a good pair agree with the right one."""
    supports = _evidence(FLAT, *good).supports
    assert [support.arrangement for support in supports] == sorted(
        Arrangement, key=[s.arrangement for s in supports].index
    )
    counts = {support.arrangement: support.features for support in supports}
    assert counts[Arrangement.RIGHT] == max(counts.values()) or counts[Arrangement.TILTED] == max(counts.values())
    assert counts[Arrangement.RIGHT] > 50
