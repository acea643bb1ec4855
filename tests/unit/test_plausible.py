"""Geometry that cannot belong to the images is refused or remarked."""

import pytest

from common.errors import SettingsError
from phone_host.model import StereoGeometry
from phone_host.stereo.plausible import is_off_the_middle, require_plausible


def _geometry(focal_px: float = 995.0, cx_px: float = 311.0, cy_px: float = 255.0) -> StereoGeometry:
    return StereoGeometry(focal_px=focal_px, baseline_m=0.193, cx_px=cx_px, cy_px=cy_px)


def test_a_focal_length_in_millimetres_is_refused() -> None:
    """3.5 px on 741 px would be a view of 179 degrees; a fifth of the width, 136 degrees, is the limit."""
    with pytest.raises(SettingsError, match=r"--focal 3\.5 is too short.*\n?.*") as refused:
        require_plausible(_geometry(3.5), (741, 500))
    assert "in px, not mm" in refused.value.remedy
    require_plausible(_geometry(0.2 * 741), (741, 500))


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
