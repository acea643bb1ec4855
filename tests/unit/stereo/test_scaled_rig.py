"""A rig at another resolution: against the projections of points through both."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.model import StereoGeometry
from phone_host.stereo.scaled_rig import scaled_geometry, scaled_rig
from tests.support.rigs import points_seen_by_both, project_points, unlike_rig


def test_points_move_with_the_pixels() -> None:
    """Pixel edges scale: a point at x appears at (x + 0.5) s - 0.5, with a scale of its own in each camera."""
    rig = unlike_rig()
    seen = points_seen_by_both(rig, 500, seed=3)
    left, right = project_points(seen.points_m, scaled_rig(rig, (1280, 960), (640, 360)))
    np.testing.assert_allclose(left, (seen.left_px + 0.5) * 2 - 0.5, atol=1e-9)
    np.testing.assert_allclose(right, (seen.right_px + 0.5) / 2 - 0.5, atol=1e-9)


def test_the_calibrated_sizes_keep_the_rig() -> None:
    """Nothing is computed for the sizes of the calibration: it is the same rig."""
    rig = unlike_rig()
    assert scaled_rig(rig, (640, 480), (1280, 720)) is rig


def test_the_uncertainty_at_infinity_scales_with_the_rectified_images() -> None:
    """Rectified images have the coarser camera's focal length: both doubled, 0.3 px are 0.6; only the finer one halved, less."""
    rig = replace(unlike_rig(), zero_sigma_px=0.3)
    assert scaled_rig(rig, (1280, 960), (2560, 1440)).zero_sigma_px == pytest.approx(0.6)
    assert scaled_rig(rig, (640, 480), (2560, 1440)).zero_sigma_px == pytest.approx(0.3)
    # The right camera at 320x180: f = 1129 / 4 = 282.25 px, the left one keeps 526 px.
    assert scaled_rig(rig, (640, 480), (320, 180)).zero_sigma_px == pytest.approx(0.3 * 282.25 / 526)
    assert math.isnan(scaled_rig(unlike_rig(), (320, 240), (1280, 720)).zero_sigma_px)


@given(st.floats(0.1, 12))
def test_a_size_rounded_to_whole_pixels_is_a_scaling(scale: float) -> None:
    """A camera that rounds 640x480 times any number to whole pixels, to the nearest or down, is accepted."""
    for rounded in (round, int):
        left = (max(1, rounded(640 * scale)), max(1, rounded(480 * scale)))
        assert scaled_rig(unlike_rig(), left, (1280, 720)).left.width_px == left[0]


@pytest.mark.parametrize("size", [(640, 360), (640, 470), (500, 480)])
def test_rows_or_columns_that_are_left_out_are_a_crop_of_the_middle(size: tuple[int, int]) -> None:
    """The principal point moves by half of what is missing; the pixels, and so depth's scale, stay. The rig says that it was cropped."""
    rig, cropped = unlike_rig(), scaled_rig(unlike_rig(), size, (1280, 720))
    moved = cropped.left.matrix - rig.left.matrix
    assert moved[0, 2] == (size[0] - 640) / 2
    assert moved[1, 2] == (size[1] - 480) / 2
    assert np.count_nonzero(moved) == 1
    assert (cropped.left.width_px, cropped.left.height_px) == size
    assert cropped.is_cropped
    assert not scaled_rig(rig, (320, 240), (1280, 720)).is_cropped


@pytest.mark.parametrize("size", [(600, 470), (1920, 1080), (100, 60), (640, 500), (700, 480)])
def test_another_shape_is_refused_with_both_sizes(size: tuple[int, int]) -> None:
    """Neither a scaling nor rows or columns left out; the error names both sizes and the remedy."""
    with pytest.raises(DataError, match=rf"left image is {size[0]}x{size[1]} px, .*640x480") as caught:
        scaled_rig(unlike_rig(), size, (1280, 720))
    assert "a size of the calibration's shape, or calibrate at this size" in caught.value.remedy
    with pytest.raises(DataError, match=r"right image is 640x480 px, .*1280x720"):
        scaled_rig(unlike_rig(), (640, 480), (640, 480))


def test_the_geometry_of_rectified_images_scales_but_not_their_baseline() -> None:
    """Half the size: half of f and doffs, the same metres for the same point."""
    full = StereoGeometry(focal_px=1000, baseline_m=0.2, cx_px=299.5, cy_px=199.5, doffs_px=30)
    half = scaled_geometry(full, (600, 400), (300, 200), "calib.txt")
    assert half == StereoGeometry(focal_px=500, baseline_m=0.2, cx_px=149.5, cy_px=99.5, doffs_px=15)
    with pytest.raises(DataError, match="300x300 px, no scaling of the 600x400 px"):
        scaled_geometry(full, (600, 400), (300, 300), "calib.txt")


def test_a_turned_image_is_told_from_another_shape() -> None:
    """Width and height exchanged: the remedy is a turn of that side."""
    with pytest.raises(DataError, match=r"left image is 480x640 px.*lies on its side.*--rotate-left 90"):
        scaled_rig(unlike_rig(), (480, 640), (1280, 720))
