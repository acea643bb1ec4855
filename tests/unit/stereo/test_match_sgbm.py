"""What the default matcher promises beyond every matcher's contract: it copes with unlike cameras and an imprecise calibration."""

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.model import RectifiedPair
from phone_host.stereo.match_sgbm import SgbmMatcher
from tests.support.planes import noise, plane


@pytest.mark.parametrize("vertical_px", [0.0, 0.5, -1.0])
@pytest.mark.parametrize("gain", [1.0, 0.6])
def test_exposure_and_vertical_drift_cost_little(vertical_px: float, gain: float) -> None:
    """A right image that is darker and up to a pixel off vertically still gives a median error of at most 0.15 px."""
    scene = plane(vertical_px=vertical_px, shortest_px=8)
    right = np.rint(scene.pair.right * gain + 10).astype(np.uint8)
    disparity = SgbmMatcher(64).match(RectifiedPair(scene.pair.left, right))
    seen = np.arange(disparity.shape[1]) - scene.disparity_px > 4
    error = np.abs(disparity - scene.disparity_px)[seen]
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmedian(error) <= 0.15


def test_what_the_right_image_does_not_show_has_no_value() -> None:
    """With a disparity of about 20, the 19 leftmost columns have no partner inside the right image and get no disparity."""
    disparity = SgbmMatcher(64).match(plane(slope_x=0.0, slope_y=0.0).pair)
    assert np.isnan(disparity[:, :19]).all()
    assert np.isfinite(disparity[:, 24:-4]).mean() > 0.95


def test_more_than_opencv_can_hold_is_refused() -> None:
    """More than 2032 disparities would overflow on an image that wide and are refused; a narrower image cannot have as many."""
    wide, narrow = noise(2100, 2), noise(300, 8)
    with pytest.raises(SettingsError, match="2032"):
        SgbmMatcher(2100).match(RectifiedPair(wide, wide))
    assert SgbmMatcher(2100).match(RectifiedPair(narrow, narrow)).shape == (8, 300)
