"""The stereo core's stages one by one, and what the core and the matchers refuse before they start."""

from dataclasses import asdict, astuple, replace

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError
from phone_host.model import Crop, CutCounts, Epipolar, Image, RectifiedPair, Rig, Search, StereoGeometry
from phone_host.scene.scene import matched_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.matcher_protocol import check_pair, grey
from phone_host.stereo.rectifier import Rectifier
from tests.support.plain_scenes import plane_scene
from tests.support.planes import noise
from tests.support.rigs import unlike_rig

GEOMETRY = StereoGeometry(focal_px=500.0, baseline_m=0.1, cx_px=31.5, cy_px=15.5)


def shifted(px: int) -> tuple[Image, Image]:
    """Random levels, and the same levels this many pixels further left."""
    left = noise(64, 32)
    return left, np.roll(left, -px, axis=1)


@pytest.mark.parametrize("name", MatcherName)
def test_a_shift_becomes_a_depth(name: MatcherName) -> None:
    """Random levels 10 px apart lie at f b / d = 500 x 0.1 / 10 = 5 m, with either matcher."""
    core = StereoCore(create_matcher(MatchSettings(name, 16)), geometry=GEOMETRY)
    ticks = iter(range(0, 10**6, 1000))
    processed = core.compute(*shifted(10), lambda: next(ticks))
    assert processed.cloud is not None
    depth_m = processed.cloud[..., 2]
    assert (processed.stages.rectify, processed.stages.match, processed.stages.reproject) == (1000, 1000, 1000)
    inner = depth_m[12:-12, 28:-12]
    assert np.nanmedian(inner) == pytest.approx(5.0, rel=0.01)
    assert np.isfinite(inner).mean() > 0.9


def test_a_geometry_may_be_of_numpys_numbers() -> None:
    """As a program reads it from a matrix."""
    geometry = StereoGeometry(**{name: np.float64(value) for name, value in asdict(GEOMETRY).items()})
    core = StereoCore(MatchSettings(MatcherName.TANDEM, 16), geometry=geometry)
    cloud = core.compute(*shifted(10), lambda: 0).cloud
    assert cloud is not None
    assert np.nanmedian(cloud[12:-12, 28:-12, 2]) == pytest.approx(5.0, rel=0.01)


def test_a_core_that_rectifies_has_the_rigs_geometry() -> None:
    """With a rectifier the geometry is the rig's, another geometry is a mistake, and images must have the calibrated sizes."""
    rectifier, matcher = Rectifier(unlike_rig()), create_matcher(MatchSettings())
    core = StereoCore(matcher, rectifier)
    assert core.geometry == rectifier.geometry
    assert core.rig is rectifier.rig
    core.require_sizes((640, 480), (1280, 720))
    with pytest.raises(DataError):
        core.require_sizes((640, 480), (640, 480))
    pair = core.compute(np.zeros((480, 640), np.uint8), np.zeros((720, 1280), np.uint8), lambda: 0).pair
    assert pair.left.shape == pair.right.shape
    with pytest.raises(ValueError, match="geometry"):
        StereoCore(matcher, rectifier, GEOMETRY)


def test_without_a_rig_sizes_agree_and_there_are_no_metres() -> None:
    """Images that come rectified have equal sizes; without a geometry the only result is disparity."""
    core = StereoCore(create_matcher(MatchSettings(MatcherName.BLOCK, 4)))
    assert core.rig is None
    with pytest.raises(DataError):
        core.compute(noise(64, 32), noise(64, 30), lambda: 0)
    processed = core.compute(*shifted(2), lambda: 0)
    assert processed.disparity is not None
    assert processed.cloud is None


def total(cut: CutCounts | None) -> int:
    """All pixels that were counted."""
    assert cut is not None
    return sum(astuple(cut))


def test_a_matchers_values_stay_to_the_bit() -> None:
    """At full size the core's disparity is the matcher's, except where it cannot be told from infinity; every pixel is counted once."""
    left, right = shifted(3)
    right[:, 40:] = left[:, 40:]  # there d = 0: infinity
    alone = create_matcher(MatchSettings(disparities=16)).match(RectifiedPair(left, right))
    processed = StereoCore(MatchSettings(disparities=16), geometry=GEOMETRY).compute(left, right, lambda: 0)
    assert (alone[:, 50:] <= 0.25).sum() > 100
    np.testing.assert_array_equal(processed.disparity, np.where(alone <= 0.25, np.nan, alone))
    assert processed.cut is not None
    assert processed.cut.at_zero == (alone <= 0.25).sum()
    assert processed.cut.unmatched == np.isnan(alone).sum()
    assert total(processed.cut) == 64 * 32
    assert processed.search == Search(scale=1.0, disparities=16)
    assert processed.geometry == GEOMETRY
    assert processed.limits is not None
    assert processed.limits.far_m == pytest.approx(40)


def test_limits_cut_the_cloud_but_not_the_disparity() -> None:
    """A plane at 5 m keeps its disparity with --far 4 m and with --near 6 m, but has no point; the counts say why."""
    for wanted, name in ((DepthWanted(far_m=4), "too_far"), (DepthWanted(near_m=6), "too_near")):
        processed = StereoCore(MatchSettings(disparities=16), geometry=GEOMETRY, wanted=wanted).compute(
            *shifted(10), lambda: 0
        )
        assert processed.disparity is not None
        assert processed.cloud is not None
        at_5_m = np.abs(processed.disparity - 10) < 1
        assert at_5_m.sum() > 500
        assert np.isnan(processed.cloud[at_5_m]).all()
        assert getattr(processed.cut, name) >= at_5_m.sum()
        assert total(processed.cut) == 64 * 32


def test_only_the_crop_has_depth_and_it_is_right() -> None:
    """Outside the crop there is neither disparity nor point; inside, the plane is where it is without a crop."""
    left = noise(400, 300)
    right = np.roll(left, -10, axis=1)
    crop = Crop(x_px=200, y_px=120, width_px=90, height_px=60)
    processed = StereoCore(MatchSettings(disparities=16), geometry=GEOMETRY, wanted=DepthWanted(crop=crop)).compute(
        left, right, lambda: 0
    )
    assert processed.disparity is not None
    assert processed.cloud is not None
    inside = np.s_[120:180, 200:290]
    assert np.nanmedian(processed.disparity[inside]) == pytest.approx(10, abs=0.1)
    assert np.isfinite(processed.disparity[inside]).mean() > 0.95
    assert np.isfinite(processed.disparity).sum() == np.isfinite(processed.disparity[inside]).sum()
    assert np.isfinite(processed.cloud[..., 2]).sum() == processed.cut.kept  # type: ignore[union-attr]
    assert processed.cut.outside == 400 * 300 - 90 * 60  # type: ignore[union-attr]
    assert total(processed.cut) == 400 * 300
    assert processed.pair.left is left


def test_a_crop_outside_is_told_before_images_are_decoded() -> None:
    """The sizes alone show that nothing of the crop lies in the rectified image of about 560 x 330 px."""
    crop = Crop(x_px=700, y_px=0, width_px=10, height_px=10)
    core = StereoCore(MatchSettings(), Rectifier(unlike_rig()), wanted=DepthWanted(search_from_m=0.5, crop=crop))
    with pytest.raises(SettingsError, match="--crop 700,0,10,10"):
        core.require_sizes((640, 480), (1280, 720))


def test_half_the_working_size_gives_the_same_metres() -> None:
    """At scale 0.5 the map has the input's size and its pixels: 10 px stay 10 px, 5 m stay 5 m, and the error doubles."""
    left = np.asarray(cv2.resize(noise(200, 100), (400, 200), interpolation=cv2.INTER_CUBIC), np.uint8)
    right = np.roll(left, -10, axis=1)
    core = StereoCore(MatchSettings(disparities=16), geometry=GEOMETRY, wanted=DepthWanted(scale=0.5))
    processed = core.compute(left, right, lambda: 0)
    assert processed.disparity is not None
    assert processed.cloud is not None
    assert processed.disparity.shape == (200, 400)
    inner = np.s_[20:-20, 40:-20]
    assert np.nanmedian(processed.disparity[inner]) == pytest.approx(10, abs=0.1)
    assert np.nanmedian(processed.cloud[inner][..., 2]) == pytest.approx(5, rel=0.01)
    assert np.nanmax(processed.disparity) < 16
    assert processed.limits is not None
    assert processed.limits.disparity_error_px == 0.5
    assert processed.limits.far_m == pytest.approx(20)


def test_a_rig_follows_the_images_size() -> None:
    """Images of half the calibration's size give half the focal length and search half as far, and the next pair of the first size is as before."""
    rectifier = Rectifier(unlike_rig())
    core = StereoCore(MatchSettings(), rectifier, wanted=DepthWanted(search_from_m=0.5))
    sizes = ((480, 640), (720, 1280)), ((240, 320), (360, 640)), ((480, 640), (720, 1280))
    found = [core.compute(np.zeros(a, np.uint8), np.zeros(b, np.uint8), lambda: 0) for a, b in sizes]
    focal_px = [each.geometry.focal_px for each in found if each.geometry]
    assert focal_px[1] == pytest.approx(focal_px[0] / 2, rel=1e-3)
    assert focal_px[2] == focal_px[0]
    # f b / near = 526 x 0.10026 / 0.5 = 105.5 -> 112, and half of it -> 64
    assert [each.search.disparities for each in found if each.search] == [112, 64, 112]
    assert found[0].pair.left.shape == found[2].pair.left.shape


def test_any_number_of_sizes_may_come() -> None:
    """Six sizes in turn, more than are kept ready: each image gets the geometry of its own size, also when it comes back."""
    core = StereoCore(MatchSettings(disparities=16), Rectifier(matched_rig()))
    for width in (160, 200, 240, 280, 320, 360, 160):
        image = np.zeros((width * 3 // 4, width), np.uint8)
        geometry = core.compute(image, image, lambda: 0).geometry
        assert geometry is not None
        assert geometry.focal_px == pytest.approx(525 * width / 640)


@pytest.mark.parametrize("y_m", [0.1, -0.1])
def test_stacked_cameras_give_an_upright_cloud(y_m: float) -> None:
    """A textured wall 1.5 m before two cameras one above the other, in either order, is found at 1.5 m, upright."""
    model = replace(matched_rig().left)
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([0.0, -y_m, 0.0]))
    scene = plane_scene(1.5)
    left, right = (render(scene, model, pose) for pose in rig_poses(rig))
    processed = StereoCore(MatchSettings(), Rectifier(rig), wanted=DepthWanted(search_from_m=0.8)).compute(
        left, right, lambda: 0
    )
    cloud = processed.cloud
    assert cloud is not None
    assert processed.pair.epipolar is (Epipolar.UP if y_m > 0 else Epipolar.DOWN)
    assert cloud.shape[:2] == processed.pair.left.shape[:2]
    assert np.abs(processed.pair.left.astype(int) - left).max() == 0  # already upright and rectified
    assert np.isfinite(cloud[..., 2]).mean() > 0.8
    assert np.nanmedian(np.abs(cloud[..., 2] - 1.5)) < 0.005
    # y grows downwards: f = 525 px, so 200 rows below the centre are 1.5 x 200 / 525 m.
    assert np.nanmedian(cloud[439, :, 1]) == pytest.approx(1.5 * 199.5 / 525, rel=0.01)


@pytest.mark.parametrize(
    ("left", "right", "word"),
    [
        (np.zeros((4, 4), np.float32), np.zeros((4, 4), np.uint8), "left"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint8), "right"),
        (np.zeros((0, 4), np.uint8), np.zeros((0, 4), np.uint8), "left"),
        (np.zeros((4, 4), np.uint8), np.zeros((4, 5), np.uint8), "5x4"),
    ],
)
def test_no_matcher_takes_what_is_no_pair(left: Image, right: Image, word: str) -> None:
    """Other types, four channels, no image and two sizes are refused; the error says which image."""
    with pytest.raises(DataError) as caught:
        check_pair(RectifiedPair(left, right))
    assert word in caught.value.problem


def test_grey_stays_itself_and_colour_is_weighed() -> None:
    """A grey image is not copied; pure green is 0.587 of white (ITU-R BT.601)."""
    image = noise(4, 4)
    assert grey(image) is image
    green = np.zeros((1, 1, 3), np.uint8)
    green[..., 1] = 255
    assert grey(green)[0, 0] == round(0.587 * 255)


def test_a_range_of_nothing_is_refused() -> None:
    """A matcher without any disparity to search is a mistake in the settings."""
    with pytest.raises(SettingsError):
        MatchSettings(disparities=0)


def test_no_more_disparities_are_searched_than_an_image_is_wide() -> None:
    """Nothing lies farther left than the edge: of 5000 disparities in 64 px of width 64 are searched, and 64 are reported, with the same result."""
    left, right = shifted(10)
    many, all_there_are = (
        StereoCore(MatchSettings(disparities=count)).compute(left, right, lambda: 0) for count in (5000, 64)
    )
    assert many.search == Search(scale=1.0, disparities=64)
    assert many.disparity is not None
    assert all_there_are.disparity is not None
    np.testing.assert_array_equal(many.disparity, all_there_are.disparity)
