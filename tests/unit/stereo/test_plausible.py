"""Geometry that cannot belong to the images is refused or remarked."""

from dataclasses import replace

import pytest

from common.errors import DataError, SettingsError
from phone_host.model import StereoGeometry
from phone_host.stereo.depth_limits import is_off_the_middle, require_plausible, require_plausible_file


def _geometry(focal_px: float = 995.0, cx_px: float = 311.0, cy_px: float = 255.0) -> StereoGeometry:
    return StereoGeometry(focal_px=focal_px, baseline_m=0.193, cx_px=cx_px, cy_px=cy_px)


def test_a_focal_length_in_millimetres_is_refused() -> None:
    """3.5 px on 741 px would be a view of 179 degrees; a fifth of the width, 136 degrees, is the limit."""
    with pytest.raises(SettingsError, match=r"--focal 3\.5 is too short.*\n?.*") as refused:
        require_plausible(_geometry(3.5), (741, 500))
    assert "in px, not mm" in refused.value.remedy
    require_plausible(_geometry(0.2 * 741), (741, 500))


@pytest.mark.parametrize("focal_px", [50.1 * 741, 1e12, 1e308, float("inf")])
def test_a_focal_length_beyond_any_lens_is_refused(focal_px: float) -> None:
    """50 image widths are a view of 1.1 degrees; more would put points at any distance."""
    with pytest.raises(SettingsError, match=r"--focal .* is too long for images 741 px wide"):
        require_plausible(_geometry(focal_px), (741, 500))
    require_plausible(_geometry(50 * 741), (741, 500))


@pytest.mark.parametrize("doffs_px", [1483.0, -1483.0, 1e30, 1e308])
def test_an_offset_wider_than_two_images_is_refused(doffs_px: float) -> None:
    """Crops that lie so far apart share nothing; twice the width is still taken."""
    with pytest.raises(SettingsError, match=r"--doffs .* is too much for images 741 px wide"):
        require_plausible(replace(_geometry(), doffs_px=doffs_px), (741, 500))
    require_plausible(replace(_geometry(), doffs_px=1482.0), (741, 500))


def test_a_file_must_fit_its_images_like_options() -> None:
    """The message names the file: 1.5 px of focal length are millimetres, and 1e5 px of doffs lie beyond the images."""
    with pytest.raises(DataError, match=r"calib\.txt: the focal length is 1\.5 px for images 160 px wide"):
        require_plausible_file(_geometry(1.5), (160, 120), "calib.txt")
    with pytest.raises(DataError, match=r"calib\.txt: doffs is 100000 px"):
        require_plausible_file(replace(_geometry(), doffs_px=1e5), (741, 500), "calib.txt")
    require_plausible_file(_geometry(cx_px=-20.0), (741, 500), "calib.txt")  # a crop beside the principal point


@pytest.mark.parametrize("point", [(3111.0, 254.0), (-1.0, 254.0), (311.0, 500.0)])
def test_a_principal_point_outside_the_image_is_refused(point: tuple[float, float]) -> None:
    """The error names the option."""
    with pytest.raises(SettingsError, match=r"--center .* outside the image of 741x500 px"):
        require_plausible(_geometry(cx_px=point[0], cy_px=point[1]), (741, 500))


def test_another_data_sets_principal_point_is_remarked() -> None:
    """KITTI's 602,183 lies in the middle of 1226x370 px and at the edge of 741x500 px."""
    assert not is_off_the_middle(_geometry(707.0, 601.9, 183.1), (1226, 370))
    assert is_off_the_middle(_geometry(707.0, 601.9, 183.1), (741, 500))
    assert not is_off_the_middle(_geometry(), (741, 500))
