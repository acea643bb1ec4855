"""A rig's own uncertainty in measured points: derivatives are those of differences, and known errors give known lengths."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.geometry.lens import (
    LEFT,
    RIG,
    RIGHT,
    parameters_of,
    pixel_derivatives,
    standard_errors,
    with_parameters,
)
from phone_host.geometry.se3 import rotations_of
from phone_host.model import RIG_PARAMETERS, Epipolar, Rig
from phone_host.stereo.measured_point import (
    Known,
    MeasuredPoint,
    ZeroError,
    distance_between,
    measured_point,
    rig_errors,
)
from phone_host.stereo.point_match import PointMatch
from phone_host.stereo.rectify import rectify_points, rectify_rig
from tests.support.rigs import fisheye_rig, project_points, unlike_rig

_POINTS_M = np.array([[0.1, 0.05, 0.8], [-0.2, 0.1, 1.5], [0.0, -0.1, 0.5]])
_EXACT = np.eye(2) * 1e-8


def moved_rig(rig: Rig, step: NDArray[np.float64]) -> Rig:
    """The rig after a (30,) step of its parameters."""
    turn, shift = step[RIG][:3], step[RIG][3:]
    return replace(
        rig,
        left=with_parameters(rig.left, parameters_of(rig.left) + step[LEFT]),
        right=with_parameters(rig.right, parameters_of(rig.right) + step[RIGHT]),
        R_right_left=rotations_of(turn) @ rig.R_right_left,
        t_right_left_m=rig.t_right_left_m + shift,
    )


def _rectified(points_m: NDArray[np.float64], true: Rig, rig: Rig) -> NDArray[np.float64]:
    """Where an estimated rig puts points that the true cameras see, (2, N, 2) px."""
    made = rectify_rig(rig)
    left, right = project_points(points_m, true)
    return np.stack(
        [
            rectify_points(left, rig.left, made.R_left, made.geometry),
            rectify_points(right, rig.right, made.R_right, made.geometry),
        ]
    )


@pytest.mark.parametrize("rig", [unlike_rig(), fisheye_rig(), unlike_rig((0.005, 0.1, 0.0))])
def test_derivatives_are_those_of_differences(rig: Rig) -> None:
    """Each of the thirty parameters, of all lenses, moves the pixels of both images as a small step of it does; OpenCV projects."""
    made = rectify_rig(rig)
    turned = _POINTS_M @ made.R_left.T
    found = pixel_derivatives(turned[:, :2] / turned[:, 2:], 1 / turned[:, 2], rig, made)
    for at in range(RIG_PARAMETERS):
        known = len(rig.left.distortion if at < RIGHT.start else rig.right.distortion) + 4
        if at < RIG.start and at % RIGHT.start >= known:
            continue  # a coefficient that this lens does not have
        step = np.zeros(RIG_PARAMETERS)
        step[at] = 1e-3 if at < RIG.start and at % RIGHT.start < 4 else 1e-6
        after, before = (_rectified(_POINTS_M, moved_rig(rig, sign * step), rig) for sign in (1, -1))
        by_difference = (after - before).swapaxes(0, 1) / (2 * step[at])
        assert found[..., at] == pytest.approx(by_difference, rel=1e-4, abs=1e-3), at


def test_independent_errors_have_the_covariance_of_unlike_units() -> None:
    """Squares in px and in rad, correlated, one of them 0: E E^T is the covariance to ten digits of each."""
    sigmas = np.array([2.0, 1e-5, 0.0, 3e-4])
    correlation = np.array([[1, 0.9, 0, 0.1], [0.9, 1, 0, 0.2], [0, 0, 1, 0], [0.1, 0.2, 0, 1]])
    covariance = correlation * np.outer(sigmas, sigmas)
    errors = standard_errors(covariance)
    assert errors @ errors.T == pytest.approx(covariance, rel=1e-10, abs=0)


def _point(point_m: NDArray[np.float64], rig: Rig, seen_by: Rig | None = None) -> MeasuredPoint:
    """A point as this rig measures it, without noise."""
    made = rectify_rig(rig)
    left, right = _rectified(point_m[np.newaxis], seen_by or rig, rig)[:, 0]
    match = PointMatch(right, _EXACT, 0.0, 0.0, 400)
    return measured_point((left[0], left[1]), match, made.geometry, made.epipolar, rig_errors(rig, made))


@pytest.mark.parametrize("centre_m", [(0.1, 0.004, -0.006), (0.004, 0.1, -0.006)])
def test_a_baseline_that_is_off_is_in_every_length(centre_m: tuple[float, float, float]) -> None:
    """A standard deviation of 1 % of the baseline and nothing else: 1 % of each distance, and 1 % of that between two points."""
    rig = unlike_rig(centre_m)
    covariance = np.zeros((RIG_PARAMETERS, RIG_PARAMETERS))
    covariance[-3:, -3:] = 1e-4 * np.outer(rig.t_right_left_m, rig.t_right_left_m)
    rig = replace(rig, covariance=covariance)
    one, other = (_point(each, rig) for each in _POINTS_M[:2])
    for length, exact in (
        (one.distance, np.linalg.norm(_POINTS_M[0])),
        (other.distance, np.linalg.norm(_POINTS_M[1])),
        (distance_between(one, other), np.linalg.norm(_POINTS_M[0] - _POINTS_M[1])),
    ):
        assert length.value_m == pytest.approx(exact, rel=1e-4)
        assert (length.high_m - length.low_m) / 2 == pytest.approx(1.959964 * 0.01 * exact, rel=0.02)


def test_a_rig_that_is_off_as_it_says_measures_what_it_says() -> None:
    """A rig whose turn, focal lengths and baseline are off: over 100 draws from its covariance, the mean square error of a distance and of a length is the stated variance within 45 % (three standard deviations)."""
    true = unlike_rig()
    sigmas = np.zeros(RIG_PARAMETERS)
    sigmas[[0, 1, 2, 3, 12, 13, 14, 15]] = 1.0
    sigmas[RIG] = [3e-4, 5e-4, 3e-4, 2e-4, 2e-4, 2e-4]
    random, shares = np.random.default_rng(4), []
    exact = np.linalg.norm(_POINTS_M, axis=1)
    for _ in range(100):
        drawn = moved_rig(true, random.normal(size=RIG_PARAMETERS) * sigmas)
        points = [_point(each, replace(drawn, covariance=np.diag(sigmas**2)), true) for each in _POINTS_M[:2]]
        lengths = [points[0].distance, points[1].distance, distance_between(points[0], points[1])]
        truth = [exact[0], exact[1], float(np.linalg.norm(_POINTS_M[0] - _POINTS_M[1]))]
        shares.append(
            [
                (1.959964 * 2 * (found.value_m - at) / (found.high_m - found.low_m)) ** 2
                for found, at in zip(lengths, truth, strict=True)
            ]
        )
    assert np.mean(shares, axis=0) == pytest.approx([1, 1, 1], abs=0.45)


def test_rows_that_the_rig_explains_are_no_noise() -> None:
    """Rays that miss each other by a pixel, where the rig's turn is known to a pixel of rows: the noise is not made larger; in an exact rig it is."""
    rig = unlike_rig()
    step = np.zeros(RIG_PARAMETERS)
    step[RIG.start] = 1 / 1130
    factors = []
    for sigma in (1 / 1130, 0.0):
        covariance = np.zeros((RIG_PARAMETERS, RIG_PARAMETERS))
        covariance[RIG.start, RIG.start] = sigma**2
        stated = replace(rig, covariance=covariance)
        factors.append(_point(_POINTS_M[0], stated, moved_rig(rig, step)).noise_factor)
    assert factors[0] == pytest.approx(1, abs=0.1)
    assert factors[1] > 100


def test_an_older_file_has_its_zero_or_nothing() -> None:
    """Without a covariance, the zero is what is known; without that, nothing: no error moves a point."""
    rig = unlike_rig()
    made = rectify_rig(rig)
    assert rig_errors(rig, made).known is Known.NOTHING
    assert rig_errors(rig, made).pixels(np.zeros(2), 1.0).shape == (0, 2, 2)
    zero = rig_errors(replace(rig, zero_sigma_px=0.3), made)
    assert zero == ZeroError(0.3, Epipolar.LEFT)
    assert zero.known is Known.ZERO
    whole = rig_errors(replace(rig, covariance=np.zeros((RIG_PARAMETERS, RIG_PARAMETERS))), made)
    assert whole.known is Known.ALL
