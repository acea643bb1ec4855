"""Points and their records from the native library: the bits of numpy, on every instruction set."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from common.diagnostic import Diagnostic
from phone_host.model import DepthLimits, Disparity, StereoGeometry
from phone_host.native.library import Library
from phone_host.output.axes import Axes
from phone_host.output.ply import packed_points
from phone_host.stereo.reproject import Points, points_of

NONE = Diagnostic(message="left out by this test", remedy="none")
VALUES = st.one_of(
    st.floats(-3, 130, width=32),
    st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -0.0, 0.25, 1e-45, 1e-30, 3.4e38, -3.4e38]),
)
SIDES = st.integers(1, 140)  # blocks are of 64 pixels
GEOMETRIES = st.builds(
    StereoGeometry,
    focal_px=st.floats(20, 2000),
    baseline_m=st.floats(0.001, 1),
    cx_px=st.floats(-100, 1000),
    cy_px=st.floats(-100, 1000),
    doffs_px=st.sampled_from([0.0, 31.5, -7.25]),
)
LIMITS = st.builds(
    DepthLimits,
    near_m=st.sampled_from([0.0, 0.3, 2.0]),
    far_m=st.sampled_from([0.1, 1.0, 30.0, 1e31]),
    disparity_error_px=st.sampled_from([0.0, 0.25, 4.0]),
    from_rig=st.booleans(),
)
same_fixture = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)


def same(a: Points, b: Points) -> bool:
    """Whether two results agree in every bit."""
    return (
        a.cloud.tobytes() == b.cloud.tobytes()
        and a.disparity.tobytes() == b.disparity.tobytes()
        and (a.counts, a.found) == (b.counts, b.found)
    )


@same_fixture
@given(shape=st.tuples(st.integers(1, 5), SIDES), geometry=GEOMETRIES, limits=LIMITS, data=st.data())
def test_points_have_the_bits_of_numpy(
    library: Library, shape: tuple[int, int], geometry: StereoGeometry, limits: DepthLimits, data: st.DataObject
) -> None:
    """Any disparities, also none, infinite, tiny and huge ones, give numpy's cloud, disparities and counts."""
    disparity: Disparity = data.draw(arrays(np.float32, shape, elements=VALUES, fill=st.just(np.nan)))
    with np.errstate(all="ignore"):
        assert same(points_of(disparity, geometry, limits, library), points_of(disparity, geometry, limits, NONE))


@pytest.mark.parametrize("part", [np.s_[:, 3:60], np.s_[::2, :], np.s_[:, ::3], np.s_[::-1, :], np.s_[:, ::-1]])
def test_a_part_of_an_image_gives_the_part_of_the_cloud(library: Library, part: tuple[slice, slice]) -> None:
    """Views with any strides are read rightly."""
    whole = np.random.default_rng(5).uniform(0, 64, (48, 90)).astype(np.float32)
    geometry = StereoGeometry(focal_px=70.0, baseline_m=0.06, cx_px=45.0, cy_px=24.0)
    limits = DepthLimits(near_m=0.1, far_m=3.0, disparity_error_px=0.25, from_rig=True)
    seen = whole[part]
    assert same(points_of(seen, geometry, limits, library), points_of(seen.copy(), geometry, limits, NONE))


def test_counts_follow_from_geometry(library: Library) -> None:
    """With f b = 10 px m, disparities 100, 10, 1 and 0.1 px lie at 0.1, 1, 10 and 100 m; between 0.5 and 50 m two are left, and 0.05 px is no measurement."""
    disparity = np.array([[100, 10, 1, 0.1, 0.05, np.nan]], np.float32)
    geometry = StereoGeometry(focal_px=100.0, baseline_m=0.1, cx_px=0.0, cy_px=0.0)
    limits = DepthLimits(near_m=0.5, far_m=50.0, disparity_error_px=0.06, from_rig=False)
    points = points_of(disparity, geometry, limits, library)
    assert (points.found, points.counts.kept, points.counts.at_zero) == (5, 2, 1)
    assert (points.counts.too_far, points.counts.too_near) == (1, 1)
    assert np.flatnonzero(np.isfinite(points.cloud[0, :, 2])).tolist() == [1, 2]
    assert points.cloud[0, 1].tolist() == pytest.approx([1 * 1 / 100, 0.0, 1.0])
    assert np.isnan(points.disparity[0]).tolist() == [False, False, False, False, True, True]


@same_fixture
@given(
    shape=st.tuples(st.integers(1, 4), SIDES),
    channels=st.sampled_from([(), (3,)]),
    axes=st.sampled_from(Axes),
    data=st.data(),
)
def test_records_have_the_bits_of_numpy(
    library: Library, shape: tuple[int, int], channels: tuple[int, ...], axes: Axes, data: st.DataObject
) -> None:
    """Any cloud, with gaps of any shape, gives numpy's records; grey images and both systems of axes, too."""
    cloud = data.draw(arrays(np.float32, (*shape, 3), elements=VALUES, fill=st.just(1.5)))
    colours = data.draw(arrays(np.uint8, (*shape, *channels)))
    packed = packed_points(cloud, colours, axes, library)
    assert packed.tobytes() == packed_points(cloud, colours, axes, NONE).tobytes()
    assert packed.size == np.count_nonzero(np.isfinite(cloud).all(axis=2))


def test_no_pixel_and_no_point(library: Library) -> None:
    """Images without pixels and clouds without points give no records."""
    for shape in ((0, 5), (5, 0), (4, 7)):
        cloud = np.full((*shape, 3), np.nan, np.float32)
        assert packed_points(cloud, np.zeros(shape, np.uint8), Axes.CAMERA, library).size == 0
    geometry = StereoGeometry(focal_px=100.0, baseline_m=0.1, cx_px=0.0, cy_px=0.0)
    limits = DepthLimits(near_m=0.5, far_m=50.0, disparity_error_px=0.06, from_rig=False)
    points = points_of(np.zeros((0, 0), np.float32), geometry, limits, library)
    assert points.cloud.shape == (0, 0, 3)
