"""Disparity to metres, against the geometry of two pinhole cameras."""

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.model import Disparity, StereoGeometry
from phone_host.stereo.reproject import disparities_for_near, nearest_depth_m, project, reproject

_GEOMETRIES = st.builds(
    StereoGeometry,
    focal_px=st.floats(100, 4000),
    baseline_m=st.floats(0.01, 1),
    cx_px=st.floats(-500, 2000),
    cy_px=st.floats(-500, 2000),
    doffs_px=st.floats(-100, 100),
)


def test_middlebury_motorcycle_numbers() -> None:
    """Depth is f b / (d + doffs), with the numbers Middlebury publishes: d = 40 px is 994.978 * 0.193001 / 71.086 = 2.70140 m."""
    geometry = StereoGeometry(focal_px=994.978, baseline_m=0.193001, cx_px=311.193, cy_px=254.877, doffs_px=31.086)
    disparity = np.full((300, 400), np.nan, dtype=np.float32)
    disparity[255, 311] = 40
    point = reproject(disparity, geometry)[255, 311]
    assert point[2] == pytest.approx(2.70140, abs=1e-5)
    assert point[0] == pytest.approx((311 - 311.193) * 2.70140 / 994.978, abs=1e-6)
    assert point[1] == pytest.approx((255 - 254.877) * 2.70140 / 994.978, abs=1e-6)


@given(
    _GEOMETRIES,
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=12),
        elements=st.floats(-200, 300, width=32) | st.just(float("nan")),
    ),
)
@settings(deadline=None, max_examples=100)
def test_project_undoes_reproject(geometry: StereoGeometry, disparity: Disparity) -> None:
    """Every pixel nearer than 1e30 m is mapped back to its place and disparity; all others are NaN in all three."""
    cloud = reproject(disparity, geometry)
    assert cloud.dtype == np.float32
    with np.errstate(invalid="ignore"):
        in_front = disparity + np.float32(geometry.doffs_px) > geometry.focal_px * geometry.baseline_m / 1e30
    assert np.isnan(cloud[~in_front]).all()
    back = project(cloud[in_front], geometry)
    rows, columns = np.nonzero(in_front)
    # float32 keeps 7 digits of slopes up to 25 and of sums up to 400 px
    np.testing.assert_allclose(back[:, 0], columns, atol=5e-3)
    np.testing.assert_allclose(back[:, 1], rows, atol=5e-3)
    np.testing.assert_allclose(back[:, 2], disparity[in_front], atol=2e-4)


def test_depth_of_a_disparity_of_zero_is_none() -> None:
    """Infinity is not a measurement: d + doffs = 0 and below give NaN, without a warning."""
    geometry = StereoGeometry(focal_px=500, baseline_m=0.1, cx_px=0, cy_px=0, doffs_px=-3)
    cloud = reproject(np.array([[3.0, 2.0, 4.0]], dtype=np.float32), geometry)
    assert np.isnan(cloud[0, :2]).all()
    assert cloud[0, 2, 2] == 50.0


@pytest.mark.parametrize(
    ("near_m", "expected"),
    [
        (0.5, 112),  # 525 * 0.1 / 0.5 = 105 -> 112
        (0.46875, 112),  # exactly 112
        (0.3, 176),  # 175 -> 176
        (100.0, 16),  # below one step
        (0.01, 320),  # never more than half the width
    ],
)
def test_disparities_reach_the_nearest_depth(near_m: float, expected: int) -> None:
    """N is f b / near rounded up to 16, at most half the width."""
    geometry = StereoGeometry(focal_px=525, baseline_m=0.1, cx_px=320, cy_px=240)
    assert disparities_for_near(geometry, near_m, width_px=640) == expected


def test_nearest_depth_is_that_of_the_largest_disparity() -> None:
    """With f b = 52.5, N = 105 reaches down to 0.5 m."""
    assert nearest_depth_m(StereoGeometry(focal_px=525, baseline_m=0.1, cx_px=320, cy_px=240), 105) == pytest.approx(
        0.5
    )
