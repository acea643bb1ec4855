"""The stereo core's stages one by one, and what the core and the matchers refuse before they start."""

import numpy as np
import pytest

from common.errors import DataError, SettingsError
from phone_host.model import Image, RectifiedPair, StereoGeometry
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_input import check_pair, grey
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectify import Rectifier
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
