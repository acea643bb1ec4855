"""The comparison of a model with the thing: a perfect model has no error and covers everything, a shifted or cut one does not."""

import math

import numpy as np
import pytest

from phone_host.demo.scan_demonstration import model_errors
from phone_host.scan.mesh import Mesh
from phone_host.scan.scan_model import ScanModel
from phone_host.scene.scene_model import Body, Sphere
from phone_host.scene.solid import Solid

RADIUS_M = 0.03
BALL = Solid((Body("ball", Sphere(RADIUS_M), (0.01, 0.0, 0.05)),))


def ball_model(shift_m: float = 0.0, above_m: float = -1.0) -> ScanModel:
    """Points of the ball's surface 1 mm apart, moved outwards, without those below a height; three of them each are a triangle."""
    samples = BALL.surface(0.001)
    points = (samples.points + shift_m * samples.normals).T
    points = points[points[:, 2] > above_m]
    count = len(points) // 3 * 3
    triangles = np.arange(count, dtype=np.int32).reshape(-1, 3)
    mesh = Mesh(points.astype(np.float32), np.zeros((len(points), 3), np.uint8), triangles)
    return ScanModel(mesh, np.zeros(len(points), np.float32), np.ones(len(points), np.bool_))


def test_a_perfect_model_has_no_error() -> None:
    """Points of the surface itself are at most a rounding off, and cover all of it."""
    errors = model_errors(ball_model(), BALL)
    assert errors.p95_mm < 1e-4
    assert errors.coverage == 1.0


def test_a_model_that_is_half_a_millimetre_too_large_is_half_a_millimetre_off() -> None:
    """Mean, median and 95th percentile all are that distance."""
    errors = model_errors(ball_model(0.0005), BALL)
    assert (errors.mean_mm, errors.median_mm, errors.p95_mm) == pytest.approx((0.5, 0.5, 0.5), abs=1e-3)


def test_what_is_missing_is_not_covered() -> None:
    """Without its lower half, but for the rim that the upper one reaches over, half of the ball is there; nothing is there of no model."""
    errors = model_errors(ball_model(above_m=0.05), BALL)
    # A zone of height h of a ball has the area 2 pi r h; the model covers 2 mm beyond its rim.
    assert errors.coverage == pytest.approx(0.5 * (1.0 + 0.002 / RADIUS_M), abs=0.01)
    nothing = model_errors(ScanModel.empty(), BALL)
    assert nothing.points == 0
    assert nothing.coverage == 0.0
    assert math.isnan(nothing.mean_mm)


def test_the_volume_of_a_closed_model_is_compared_and_what_nobody_saw_is_not() -> None:
    """A tetrahedron of 100 mm edges along the axes has 1000 / 6 cm3, the ball 36 pi; of its four corners only the seen one counts."""
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], np.float32)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    mesh = Mesh(corners, np.zeros((4, 3), np.uint8), triangles)
    seen = np.array([True, False, False, False])
    errors = model_errors(ScanModel(mesh, np.zeros(4, np.float32), seen, is_closed=True), BALL)
    assert errors.points == 1
    assert errors.mean_mm == pytest.approx(1000 * math.hypot(0.01, 0.05) - 30.0, abs=1e-3)
    assert errors.volume_percent == pytest.approx(100 * (1000 / 6 / (36 * math.pi) - 1), abs=0.3)
