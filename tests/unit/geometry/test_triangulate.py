"""Best-fit intersection of noisy rays: exact without noise, the known optimum with it, and a covariance that holds."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.geometry.triangulate import Intersections, triangulate

Floats = NDArray[np.float64]

_CHI2_3_95 = 7.814727903251178
"""95 % of chi-squared values with three degrees of freedom lie below (Abramowitz and Stegun, table 26.8)."""


def _pose(turn: tuple[float, float, float], t_m: tuple[float, float, float]) -> SE3:
    return SE3(np.asarray(cv2.Rodrigues(np.array(turn))[0], np.float64), np.array(t_m))


RIGHT = _pose((0.02, -0.08, 0.03), (-0.1, 0.004, 0.01))
THIRD = _pose((-0.3, 0.1, 0.0), (0.05, 0.4, -0.02))


def _scattered(count: int, seed: int, depth_m: tuple[float, float] = (0.3, 4.0)) -> Floats:
    random = np.random.default_rng(seed)
    depth = random.uniform(*depth_m, count)
    return np.column_stack([random.uniform(-0.4, 0.4, (count, 2)) * depth[:, None], depth])


def _slopes(points_m: Floats, pose: SE3) -> Floats:
    seen = pose.apply(points_m)
    return seen[:, :2] / seen[:, 2:]


def _same(sigma: float, count: int) -> Floats:
    return np.broadcast_to(np.eye(2) * sigma**2, (count, 2, 2))


def _of(points_m: Floats, poses: list[SE3], sigmas: list[float], seed: int = 0) -> Intersections:
    """Triangulate points from slopes with noise of these sigmas, one for each camera."""
    random = np.random.default_rng(seed)
    slopes = [
        _slopes(points_m, pose) + random.normal(0, 1, (len(points_m), 2)) * sigma
        for pose, sigma in zip(poses, sigmas, strict=True)
    ]
    stated = [_same(max(sigma, 1e-4), len(points_m)) for sigma in sigmas]
    return triangulate(np.array(slopes), np.array(stated), poses)


def test_motions_chain_and_go_back() -> None:
    """T_a_b T_b_c takes c to a; the inverse takes it back; the identity moves nothing."""
    points = _scattered(5, 1)
    there = (RIGHT @ THIRD).apply(points)
    np.testing.assert_allclose(there, RIGHT.apply(THIRD.apply(points)), atol=1e-14)
    np.testing.assert_allclose((RIGHT @ THIRD).inverse().apply(there), points, atol=1e-14)
    np.testing.assert_array_equal(SE3.identity().apply(points), points)


@pytest.mark.parametrize("poses", [[RIGHT], [RIGHT, THIRD]], ids=["two", "three"])
def test_exact_rays_meet_in_the_point(poses: list[SE3]) -> None:
    """Two cameras, or three: points from 0.3 m to 400 m come back to a millionth, with chi-squared 0."""
    points = np.concatenate([_scattered(50, 2), _scattered(50, 3, (50.0, 400.0))])
    found = _of(points, [SE3.identity(), *poses], [0.0] * (1 + len(poses)))
    np.testing.assert_allclose(found.points_m, points, rtol=1e-6, atol=1e-9)
    assert np.abs(found.chi2).max() < 1e-12


def test_the_optimum_is_that_of_hartley_and_sturm() -> None:
    """With equal noise, projections of the point are the corrected points of cv2.correctMatches, which solves their polynomial."""
    points = _scattered(40, 4)
    random = np.random.default_rng(5)
    a, b = (_slopes(points, pose) + random.normal(0, 0.004, (40, 2)) for pose in (SE3.identity(), RIGHT))
    found = triangulate(np.array([a, b]), np.array([_same(0.004, 40)] * 2), [SE3.identity(), RIGHT])
    x, y, z = RIGHT.t_m
    essential = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ RIGHT.R
    best = cv2.correctMatches(essential, a[None], b[None])
    for pose, theirs in zip((SE3.identity(), RIGHT), best, strict=True):
        np.testing.assert_allclose(_slopes(found.points_m, pose), np.asarray(theirs)[0], atol=2e-6)


def test_a_surer_camera_counts_more() -> None:
    """Where the right camera is ten times as sure, the point lies on its ray to a hundredth of what it misses the left one's."""
    points = _scattered(30, 6)
    random = np.random.default_rng(7)
    seen = np.array([_slopes(points, pose) + random.normal(0, 0.003, (30, 2)) for pose in (SE3.identity(), RIGHT)])
    found = triangulate(seen, np.array([_same(0.01, 30), _same(0.001, 30)]), [SE3.identity(), RIGHT])
    off = [
        np.linalg.norm(_slopes(found.points_m, pose) - at, axis=1)
        for pose, at in zip((SE3.identity(), RIGHT), seen, strict=True)
    ]
    assert np.median(off[1] / off[0]) == pytest.approx(0.01, rel=0.2)


@pytest.mark.parametrize(("sigmas", "poses"), [([2e-3, 1e-3], [RIGHT]), ([1e-3, 2e-3, 1e-3], [RIGHT, THIRD])])
def test_the_truth_lies_inside_the_95_per_cent_ellipsoid(sigmas: list[float], poses: list[SE3]) -> None:
    """Of 10^4 noisy points the stated ellipsoid of a, b and w holds 94 to 96 %; chi-squared has its expectation 2 C - 3."""
    points = _scattered(10_000, 8)
    found = _of(points, [SE3.identity(), *poses], sigmas, seed=9)
    true = np.column_stack([points[:, :2] / points[:, 2:], 1 / points[:, 2]])
    error = found.parameters - true
    distance = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.parameter_covariance), error)
    assert 0.94 < (distance < _CHI2_3_95).mean() < 0.96
    assert found.chi2.mean() == pytest.approx(2 * len(sigmas) - 3, rel=0.05)


def test_near_points_have_the_covariance_of_repeated_measurements() -> None:
    """The scatter of 4000 measurements of one point at 0.5 m is its stated covariance, to 10 %, and the textbook's depth error."""
    point = np.array([[0.05, -0.02, 0.5]])
    parallel = SE3(np.eye(3), np.array([-0.1, 0.0, 0.0]))
    found = _of(np.repeat(point, 4000, axis=0), [SE3.identity(), parallel], [5e-4, 5e-4], seed=10)
    scatter = np.cov(found.points_m.T)
    stated = found.covariance_m2.mean(axis=0)
    np.testing.assert_allclose(np.sqrt(np.diag(scatter)), np.sqrt(np.diag(stated)), rtol=0.1)
    # sigma_z = z^2 sigma_disparity / b, and the disparity is the difference of two slopes.
    assert np.sqrt(stated[2, 2]) == pytest.approx(0.5**2 * 5e-4 * np.sqrt(2) / 0.1, rel=0.05)


def test_rays_that_meet_nowhere_give_nan() -> None:
    """Parallel rays, rays that diverge (behind the cameras), and NaN itself: no point, and nothing is raised."""
    parallel = SE3(np.eye(3), np.array([-0.1, 0.0, 0.0]))
    a = np.array([[0.1, 0.0], [0.1, 0.0], [np.nan, 0.0], [0.1, 0.0]])
    b = np.array([[0.1, 0.0], [0.2, 0.0], [0.1, 0.0], [0.05, 0.0]])
    found = triangulate(np.array([a, b]), np.array([_same(1e-3, 4)] * 2), [SE3.identity(), parallel])
    assert np.isnan(found.points_m[:3]).all()
    assert found.points_m[3] == pytest.approx([0.2, 0.0, 2.0])
    assert found.parameters[0, 2] == pytest.approx(0, abs=1e-9)
    assert found.parameters[1, 2] == pytest.approx(-1.0)
    same_place = triangulate(np.array([a[3:], a[3:]]), np.array([_same(1e-3, 1)] * 2), [SE3.identity()] * 2)
    assert np.isnan(same_place.points_m).all()
