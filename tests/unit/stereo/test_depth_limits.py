"""How far a rig sees: the limits against the error they promise, and clouds against their limits."""

import math

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.model import Crop, DepthLimits, Disparity, StereoGeometry
from phone_host.stereo.depth_limits import (
    DepthWanted,
    above_zero,
    crop_inside,
    cut_cloud,
    depth_limits,
    disparity_error_px,
)
from phone_host.stereo.reproject import reproject

GEOMETRY = StereoGeometry(focal_px=500.0, baseline_m=0.1, cx_px=31.5, cy_px=15.5)
_GEOMETRIES = st.builds(
    StereoGeometry,
    focal_px=st.floats(5, 4000),
    baseline_m=st.floats(0.01, 1),
    cx_px=st.floats(-500, 2000),
    cy_px=st.floats(-500, 2000),
    doffs_px=st.floats(-100, 100),
)


@given(st.floats(0.3, 1000), st.floats(-1, 1))
def test_the_relative_error_of_a_measured_depth_is_the_error_over_the_measured_disparity(
    d: float, share: float
) -> None:
    """A measured D whose truth is D + e gives a depth wrong by exactly e / D of the true one, in both directions."""
    error = share * min(0.25, d * 0.9)
    found, true = 50 / d, 50 / (d + error)
    assert (found - true) / true == pytest.approx(error / d, abs=1e-12)


def test_the_far_limit_follows_from_the_rig() -> None:
    """The limit is f b s / delta = 500 x 0.1 x 0.2 / 0.25 = 40 m; there D = 1.25 px, and 0.25 px are 20 % of it."""
    limits = depth_limits(GEOMETRY, 0.25, DepthWanted())
    assert limits == DepthLimits(near_m=0.0, far_m=limits.far_m, disparity_error_px=0.25, from_rig=True)
    assert limits.far_m == pytest.approx(40.0)
    assert 0.25 / (50 / limits.far_m) == pytest.approx(0.2)
    assert depth_limits(GEOMETRY, 0.25, DepthWanted(), share=0.05).far_m == pytest.approx(10.0)


def test_a_given_limit_replaces_the_rigs() -> None:
    """--far stands, nearer or farther than the rig's limit."""
    for far_m in (5.0, 400.0):
        limits = depth_limits(GEOMETRY, 0.25, DepthWanted(far_m=far_m, near_m=0.5))
        assert limits == DepthLimits(near_m=0.5, far_m=far_m, disparity_error_px=0.25, from_rig=False)


def test_the_larger_error_counts_at_full_size() -> None:
    """A quarter of a pixel of half-size images is half a pixel; the rig's own error counts where it is larger, and only if it was measured."""
    assert disparity_error_px(1.0, math.nan) == 0.25
    assert disparity_error_px(0.5, math.nan) == 0.5
    assert disparity_error_px(1.0, 0.4) == 0.4
    assert disparity_error_px(0.5, 0.4) == 0.5


def test_what_cannot_be_told_from_infinity_is_no_measurement() -> None:
    """D = d + doffs at or below delta becomes NaN and is counted, also behind infinity; everything else stays, to the bit."""
    disparity = np.array([[0.0, 0.25, 0.26, np.nan, 7.5]], np.float32)
    left, count = above_zero(disparity, 0.0, 0.25)
    assert count == 2
    np.testing.assert_array_equal(left, np.array([[np.nan, np.nan, 0.26, np.nan, 7.5]], np.float32))
    assert above_zero(disparity, 31.0, 0.25) == (disparity, 0)
    assert above_zero(disparity, -7.0, 0.25)[1] == 3


@given(
    _GEOMETRIES,
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=12),
        elements=st.floats(0, 300, width=32) | st.just(float("nan")),
    ),
    st.floats(0.01, 500),
    st.floats(0, 2),
)
def test_no_coordinate_reaches_the_far_limit_and_every_point_is_counted(
    geometry: StereoGeometry, disparity: Disparity, far_m: float, near_m: float
) -> None:
    """For any geometry and limits: |x|, |y| and z of what remains lie below the far limit, z not below the near one, and the counts add up."""
    cloud = reproject(disparity, geometry)
    before = cloud.copy()
    counts = cut_cloud(
        cloud, geometry, DepthLimits(near_m=near_m, far_m=far_m, disparity_error_px=0.25, from_rig=False)
    )
    kept = np.isfinite(cloud[..., 2])
    assert (np.abs(cloud[kept].astype(np.float64)) < far_m).all()
    assert (cloud[kept][:, 2] >= np.float32(near_m)).all()
    np.testing.assert_array_equal(cloud[kept], before[kept])
    assert np.isnan(cloud[~kept]).all()
    assert counts.kept == kept.sum()
    assert counts.kept + counts.too_far + counts.too_near == np.isfinite(before[..., 2]).sum()


def test_too_far_and_too_near_are_told_apart() -> None:
    """Disparities of 1, 10 and 200 px lie at 50, 5 and 0.25 m: between 0.3 and 40 m only the second is left."""
    cloud = reproject(np.array([[1, 10, 200]], np.float32), GEOMETRY)
    counts = cut_cloud(cloud, GEOMETRY, depth_limits(GEOMETRY, 0.25, DepthWanted(near_m=0.3)))
    assert (counts.kept, counts.too_far, counts.too_near) == (1, 1, 1)
    assert cloud[0, 1, 2] == pytest.approx(5.0)


def test_a_crop_is_cut_to_the_image_and_refused_outside() -> None:
    """What reaches beyond the image is left out; what lies outside altogether is a mistake."""
    inside = crop_inside(Crop(x_px=50, y_px=10, width_px=100, height_px=10), 64, 32)
    assert inside == Crop(x_px=50, y_px=10, width_px=14, height_px=10)
    with pytest.raises(SettingsError, match=r"--crop 64,0,10,10 lies outside .* 64x32 px"):
        crop_inside(Crop(x_px=64, y_px=0, width_px=10, height_px=10), 64, 32)
