"""One point, found in the right image to a fraction of a pixel: exact on exact images, honest on noisy ones, refused where nothing is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Disparity, Epipolar, Image, RectifiedPair, StereoGeometry
from phone_host.stereo.measured_point import (
    MeasuredPoint,
    Wide,
    Within,
    ZeroError,
    distance_between,
    measured_point,
    why_wide,
)
from phone_host.stereo.point_match import PointMatch, Unmatched, match_point
from phone_host.stereo.point_window import cubic
from tests.support.planes import Plane, noise, plane

GEOMETRY = StereoGeometry(focal_px=500.0, baseline_m=0.1, cx_px=159.5, cy_px=79.5)


def _noisy(image: Image, sigma: float, random: np.random.Generator) -> Image:
    return np.asarray(np.clip(np.rint(image + random.normal(0, sigma, image.shape)), 0, 255), np.uint8)


def _rough(exact: NDArray[np.float64], random: np.random.Generator) -> Disparity:
    """What a matcher gives: the truth with an error of a fifth of a pixel."""
    return np.asarray(exact + random.normal(0, 0.2, exact.shape), np.float32)


def _found(pair: RectifiedPair, disparity: Disparity, at_px: tuple[float, float], step_px: float = 1.0) -> PointMatch:
    match = match_point(pair, disparity, at_px, step_px)
    assert isinstance(match, PointMatch), match
    return match


def test_cubic_convolution_is_exact_for_parabolas() -> None:
    """Keys' kernel reproduces x^2 + x y and its derivatives between pixels; outside it says so."""
    y, x = np.mgrid[:8, :9].astype(np.float64)
    at_x, at_y = np.array([[2.25, 4.5]]), np.array([[3.75, 2.0]])
    value, by_x, by_y, inside = cubic(x * x + x * y, at_x, at_y)
    np.testing.assert_allclose(value, at_x**2 + at_x * at_y)
    np.testing.assert_allclose(by_x, 2 * at_x + at_y)
    np.testing.assert_allclose(by_y, at_x)
    assert inside.all()
    assert not cubic(x, np.array([[0.5, 8.0]]), np.array([[3.0, 3.0]]))[3].any()
    assert not cubic(x[:3], at_x, at_y)[3].any()


@pytest.mark.parametrize("step_px", [1.0, 2.0])
def test_a_slanted_plane_is_found_to_hundredths(step_px: float) -> None:
    """On a textured plane with slopes, at fractions of pixels, the disparity is exact to 0.02 px, also from a coarse search."""
    seen = plane(slope_x=0.05, slope_y=-0.03, near_px=15.3)
    start = np.asarray(seen.disparity_px + 0.4 * step_px, np.float32)
    for at_px in ((100.3, 60.8), (200.0, 100.0), (150.5, 40.25)):
        match = _found(seen.pair, start, at_px, step_px)
        exact = 15.3 + 0.05 * at_px[0] - 0.03 * at_px[1]
        assert match.disparity_px == pytest.approx(exact, abs=0.02)
        assert match.right_px == pytest.approx([at_px[0] - exact, at_px[1]], abs=0.03)
        assert match.across_px == pytest.approx(0, abs=0.02)


def test_rows_that_are_off_and_other_levels_do_no_harm() -> None:
    """The right image lies 0.4 px too low and is darker: the disparity stays, and the offset across the lines is found."""
    seen = plane(vertical_px=0.4, slope_y=0.0)
    dark = np.asarray(np.rint(seen.pair.right * 0.6 + 20), np.uint8)
    match = _found(RectifiedPair(seen.pair.left, dark), seen.disparity_px.astype(np.float32), (150.0, 80.0))
    assert match.disparity_px == pytest.approx(20 + 0.03 * 150, abs=0.03)
    assert match.right_px[1] == pytest.approx(80.4, abs=0.03)


@pytest.mark.parametrize("epipolar", [Epipolar.UP, Epipolar.DOWN])
def test_columns_as_epipolar_lines(epipolar: Epipolar) -> None:
    """Images turned by a quarter, as of cameras one above the other: the point moves along its column."""
    seen = plane(slope_y=0.0)
    turns = 3 if epipolar is Epipolar.UP else 1
    left, right = (np.rot90(each, turns).copy() for each in (seen.pair.left, seen.pair.right))
    disparity = np.rot90(seen.disparity_px, turns)
    match = _found(RectifiedPair(left, right, epipolar), disparity.astype(np.float32), (80.0, 150.0))
    column = 150.0 if epipolar is Epipolar.UP else 319 - 150.0
    exact = 20 + 0.03 * column
    assert match.disparity_px == pytest.approx(exact, abs=0.03)
    assert match.right_px == pytest.approx(
        [80.0, 150.0 - exact if epipolar is Epipolar.UP else 150.0 + exact], abs=0.04
    )


@pytest.mark.parametrize("sigma", [2.0, 6.0])
def test_the_truth_lies_inside_the_stated_95_per_cent(sigma: float) -> None:
    """200 points of planes with noise of 2 and 6 levels: 90 to 99.5 % of the distances hold the truth, which is three standard deviations of 200 such cases."""
    inside = []
    for seed in range(4):
        random = np.random.default_rng([seed, int(sigma)])
        seen = plane(seed=seed, shortest_px=5.0)
        pair = RectifiedPair(_noisy(seen.pair.left, sigma, random), _noisy(seen.pair.right, sigma, random))
        rough = _rough(seen.disparity_px, random)
        for x, y in random.uniform([70, 20], [300, 140], (50, 2)).tolist():
            point = measured_point((x, y), _found(pair, rough, (x, y)), GEOMETRY)
            z = GEOMETRY.focal_px * GEOMETRY.baseline_m / (20 + 0.03 * x + 0.01 * y)
            ray = [(x - GEOMETRY.cx_px) / GEOMETRY.focal_px, (y - GEOMETRY.cy_px) / GEOMETRY.focal_px, 1]
            inside.append(point.distance.low_m <= z * np.linalg.norm(ray) <= point.distance.high_m)
    assert 0.9 < np.mean(inside) < 0.996


def test_noise_makes_a_point_less_sure() -> None:
    """Ten times the noise leaves between five and twenty times the standard deviation."""
    seen, sigmas = plane(), []
    for level in (0.8, 8.0):
        random = np.random.default_rng(3)
        pair = RectifiedPair(_noisy(seen.pair.left, level, random), _noisy(seen.pair.right, level, random))
        match = _found(pair, seen.disparity_px.astype(np.float32), (160.0, 80.0))
        sigmas.append(np.sqrt(match.covariance_px2[0, 0]))
    assert 3 < sigmas[1] / sigmas[0] < 20


def _flat(seen: Plane) -> RectifiedPair:
    return RectifiedPair(np.full_like(seen.pair.left, 90), np.full_like(seen.pair.right, 90))


def test_what_cannot_be_known_is_refused_with_its_reason() -> None:
    """Outside, no disparity, one colour, another scene in the right image, an edge of the matcher's surface."""
    seen = plane()
    disparity = seen.disparity_px.astype(np.float32)
    assert match_point(seen.pair, disparity, (-1.0, 5.0)) is Unmatched.OUTSIDE
    assert match_point(seen.pair, disparity, (319.5, 5.0)) is Unmatched.OUTSIDE
    hole = disparity.copy()
    hole[70:91, 150:171] = np.nan
    assert match_point(seen.pair, hole, (160.2, 79.9)) is Unmatched.NO_DISPARITY
    assert match_point(_flat(seen), disparity, (160.0, 80.0)) in {Unmatched.UNSURE, Unmatched.UNLIKE}
    other = RectifiedPair(seen.pair.left, noise(320, 160))
    assert match_point(other, disparity, (160.0, 80.0)) in {Unmatched.UNSURE, Unmatched.UNLIKE}
    step = disparity.copy()
    step[:, 161:] += 9
    assert match_point(seen.pair, step, (160.0, 80.0)) is Unmatched.NO_SURFACE


def test_a_plain_piece_belongs_to_the_surface_around_it() -> None:
    """A matcher has nothing in a plain square beside the point: the point is found. Beside another surface the same hole may be what one camera cannot see."""
    seen = plane()
    disparity = seen.disparity_px.astype(np.float32)
    disparity[76:90, 158:176] = np.nan
    exact = 20 + 0.03 * 159.6 + 0.01 * 78.2
    assert _found(seen.pair, disparity, (159.6, 78.2)).disparity_px == pytest.approx(exact, abs=0.03)
    disparity[60:100, 170:190] += 9
    assert match_point(seen.pair, disparity, (159.6, 78.2)) is Unmatched.NO_SURFACE
    disparity[:, :] = np.nan
    disparity[80, 155:160] = 25.0
    assert match_point(seen.pair, disparity, (159.6, 79.2)) is Unmatched.NO_SURFACE


def test_wide_limits_have_a_reason() -> None:
    """Each part of the uncertainty in turn is the largest; narrow limits have none."""

    def reason(match: PointMatch, zero_sigma_px: float = math.nan) -> Wide | None:
        return why_wide(measured_point((159.5, 79.5), match, GEOMETRY, rig=ZeroError(zero_sigma_px)), match)

    assert reason(_match((109.5, 79.5))) is None
    assert reason(_match((109.5, 79.5)), 5.0) is Wide.RIG
    assert reason(_match((109.5, 84.5), 0.2, across_px=5.0)) is Wide.MISSED
    assert reason(_match((155.5, 79.5), 0.05)) is Wide.FAR
    assert reason(_match((149.5, 79.5), 0.3)) is Wide.TEXTURE
    assert reason(replace(_match((149.5, 79.5), 0.3), pixels=100)) is Wide.NEIGHBOURS


def _match(right_px: tuple[float, float], sigma_px: float = 0.1, across_px: float = 0.0) -> PointMatch:
    return PointMatch(np.array(right_px), np.eye(2) * sigma_px**2, 0.0, across_px, 400)


def test_a_measured_point_has_the_textbooks_depth_and_error() -> None:
    """At the principal point, d = 50 px: z = f b / d = 1 m, sigma = z^2 sigma_d / (f b) = 2 mm; limits lie evenly in 1 / z."""
    point = measured_point((159.5, 79.5), _match((109.5, 79.5)), GEOMETRY)
    assert point.point_m == pytest.approx([0, 0, 1.0])
    assert np.sqrt(point.covariance_m2[2, 2]) == pytest.approx(0.002, rel=1e-3)
    assert point.distance.value_m == pytest.approx(1.0)
    assert point.noise_factor == 1.0
    assert point.distance.low_m == pytest.approx(50 / (50 + 1.959964 * 0.1), rel=1e-5)
    assert point.distance.high_m == pytest.approx(50 / (50 - 1.959964 * 0.1), rel=1e-5)
    assert point.rig_m.shape == (0, 3)


def test_doffs_and_both_ways_of_columns_give_the_same_point() -> None:
    """With doffs the right principal point moves along; cameras one above the other see the same depth down their columns."""
    shifted = measured_point((159.5, 79.5), _match((119.5, 79.5)), replace(GEOMETRY, doffs_px=10.0))
    up = measured_point((159.5, 79.5), _match((159.5, 29.5)), GEOMETRY, Epipolar.UP)
    down = measured_point((159.5, 79.5), _match((159.5, 129.5)), GEOMETRY, Epipolar.DOWN)
    for point in (shifted, up, down):
        assert point.point_m == pytest.approx([0, 0, 1.0])


def test_rays_that_miss_each_other_make_everything_less_sure() -> None:
    """A miss of 0.3 px where 0.1 px were stated: three times the uncertainty, and the miss is told."""
    sure = measured_point((159.5, 79.5), _match((109.5, 79.5)), GEOMETRY)
    missed = measured_point((159.5, 79.5), _match((109.5, 79.8), across_px=-0.3), GEOMETRY)
    assert missed.noise_factor == pytest.approx(3.0, rel=1e-3)
    assert missed.miss_px == 0.3
    assert missed.covariance_m2[2, 2] == pytest.approx(9 * sure.covariance_m2[2, 2], rel=1e-2)


def test_the_rigs_zero_moves_all_points_together() -> None:
    """0.5 px of zero at d = 50 px moves the depth by 1 %; two points at one depth keep their distance, two depths do not."""
    middle = measured_point((159.5, 79.5), _match((109.5, 79.5), 0.01), GEOMETRY, rig=ZeroError(0.5))
    assert abs(middle.rig_m[0, 2]) == pytest.approx(0.01, rel=0.02)
    assert middle.distance.high_m - 1 == pytest.approx(1.96 * 0.01, rel=0.05)
    beside = measured_point((209.5, 79.5), _match((159.5, 79.5), 0.01), GEOMETRY, rig=ZeroError(0.5))
    across = distance_between(middle, beside)
    assert across.value_m == pytest.approx(0.1)
    assert across.high_m - across.value_m == pytest.approx(1.96 * 0.1 * 0.01, rel=0.1)  # the scale: 1 % of it
    far = measured_point((159.5, 79.5), _match((134.5, 79.5), 0.01), GEOMETRY, rig=ZeroError(0.5))
    along = distance_between(middle, far)
    assert along.value_m == pytest.approx(1.0)
    # At 2 m the zero moves a point by 40 mm, at 1 m by 10 mm, both the same way.
    assert along.high_m - along.value_m == pytest.approx(1.96 * 0.03, rel=0.1)


def test_points_at_infinity_have_an_open_limit() -> None:
    """At d = 0.1 px with a standard deviation of 0.1 px: the upper limit is infinite; behind infinity there is no point."""
    far = measured_point((159.5, 79.5), _match((159.4, 79.5)), GEOMETRY)
    assert far.distance.value_m == pytest.approx(500)
    assert far.distance.high_m == np.inf
    assert far.distance.low_m < 500
    behind = measured_point((159.5, 79.5), _match((160.5, 79.5)), GEOMETRY)
    assert np.isnan(behind.point_m).all()
    assert behind.distance.value_m == np.inf


def test_one_point_twice_has_no_distance() -> None:
    """The distance of a point from itself is 0, up to the largest uncertainty of both: that of the depth, 2 mm each."""
    point: MeasuredPoint = measured_point((159.5, 79.5), _match((109.5, 79.5)), GEOMETRY)
    same: Within = distance_between(point, point)
    assert (same.value_m, same.low_m) == (0.0, 0.0)
    assert same.high_m == pytest.approx(1.96 * 0.002 * np.sqrt(2), rel=1e-2)
