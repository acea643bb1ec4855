"""Depths far away are noisier than near ones: how far a view may lie from the model follows from the noise of its own depths."""

import math
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.native.library import native
from phone_host.scan.piece import Piece, PoseGate
from phone_host.scan.registration import Registered
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings, fineness_for
from tests.support.plane_films import Plane, plane_at, plane_view, texture

PICTURE = texture()
HERE = SE3.identity()
NOISE_PX = 0.3
END_M = 4.2
CORRIDOR = (
    plane_at([0, 1.2, 0], [np.pi / 2, 0, 0]),
    plane_at([0, -1.2, 0], [-np.pi / 2, 0, 0]),
    plane_at([-0.9, 0, 0], [0, -np.pi / 2, 0]),
    plane_at([0.9, 0, 0], [0, np.pi / 2, 0]),
    plane_at([0, 0, END_M], [0, 0, 0]),
)
"""Floor, ceiling, two walls and the wall at the end."""


def noisy(view: View, errors_px: float, seed: int) -> View:
    """The view with disparities that err over some pixels together, as a matcher's do."""
    errors = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=view.grey.shape), (0, 0), 4.0)
    product = view.geometry.focal_px * view.geometry.baseline_m
    disparity = product / view.depth_m + errors_px * errors / errors.std()
    return replace(view, depth_m=(product / disparity).astype(np.float32))


@cache
def corridor_view(number: int, step_m: float = 0.15) -> View:
    """What a camera sees that walks towards the end of the corridor. Its disparities are better than the rig is said to be."""
    pose = SE3.of(np.array([0.0, 0.0, 0.0, 0.0, 0.0, number * step_m]))
    return noisy(plane_view(pose, PICTURE, CORRIDOR, NOISE_PX), 0.04, number)


def test_a_wall_that_comes_within_reach_is_no_poor_fit() -> None:
    """The first views show near walls only; that the far one, once it is within reach, lies as much farther off as its depths are noisier keeps none out."""
    tracker = Tracker(fineness_for(corridor_view(0), math.nan, 300_000_000))
    told = [tracker.track(corridor_view(number)) for number in range(9)]
    assert [each.weakness for each in told if each.state is Tracking.LOST] == []


def test_depths_that_err_more_than_those_before_fit_poorly() -> None:
    """At the same place, errors three times as large as those of the views before are no matter of distance."""
    tracker = Tracker(fineness_for(corridor_view(0), math.nan, 300_000_000))
    for number in range(4):
        tracker.track(corridor_view(number))
    assert tracker.track(noisy(corridor_view(4), 0.5, 9)).weakness is Weakness.POOR_FIT


def wall_ahead(depth_m: float, turn: float = 0.0) -> Plane:
    """A wall across the camera's axis, or turned about the vertical."""
    return plane_at([0, 0, depth_m], [0.0, turn, 0.0])


def fit_of(plane: Plane) -> Registered:
    """How noisy views of a wall lie on its surface, which one view without noise gave."""
    piece = Piece(VolumeSettings(voxel_m=0.02, far_m=6.0, truncation_voxels=14.0), 1, PoseGate(), native())
    exact = plane_view(HERE, PICTURE, (plane,), 0.1)
    piece.fuse(exact, HERE, None)
    return piece.laid(noisy(exact, 0.1, 3), HERE, 1e-6)


@pytest.mark.parametrize("plane", [wall_ahead(1.5), wall_ahead(3.0), wall_ahead(2.0, 1.0)])
def test_noise_says_how_far_depths_lie_off(plane: Plane) -> None:
    """A wall that is near, far, or seen at a slant: the mean distance of normal errors is 0.8 standard deviations, less what the surface's own noise adds to these."""
    fit = fit_of(plane)
    depths_m = fit.noise_m - 0.3 * 0.02
    assert fit.off_m == pytest.approx(math.sqrt(2 / math.pi) * depths_m, rel=0.15)
