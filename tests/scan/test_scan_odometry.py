"""Odometry: points, poses and windows of keyframes, on observations made by geometry and on a drawn plane."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.camera_pose import LEAST_INLIERS, Observer, by_motion, located, refined
from phone_host.scan.odometry import Odometry, OdometrySettings, followed, new_corners
from phone_host.scan.view import halved, reduced
from phone_host.scan.window import Keyframe, fitted
from tests.support.plane_films import distance, path, plane_view, texture

GEOMETRY = StereoGeometry(focal_px=300.0, baseline_m=0.12, cx_px=159.5, cy_px=119.5, doffs_px=2.0)
OBSERVATION = Observer(GEOMETRY, 0.3)
PICTURE = texture()


def points(count: int, seed: int = 3) -> np.ndarray:
    """Places in front of a camera at the origin."""
    random = np.random.default_rng(seed)
    depth = random.uniform(1, 6, count)
    return np.column_stack([random.uniform(-0.4, 0.4, count) * depth, random.uniform(-0.3, 0.3, count) * depth, depth])


def test_an_observation_puts_a_point_where_it_was_seen() -> None:
    """Projecting and reprojecting is the identity, with a common error of the disparities, too."""
    observer = Observer(GEOMETRY, 0.3, 0.4)
    assert np.allclose(observer.points(observer.projected(points(20))), points(20))
    assert np.allclose(observer.projected(points(20))[:, 2], OBSERVATION.projected(points(20))[:, 2] + 0.4)


def test_derivatives_are_those_of_small_motions() -> None:
    """A point's derivatives by turn and shift are the differences that such motions make."""
    places = points(5)
    slopes = by_motion(OBSERVATION.slopes(places), places)
    for axis in range(6):
        step = 1e-6 * np.eye(6)[axis]
        moved = [OBSERVATION.projected(SE3.of(sign * step).apply(places)) for sign in (1, -1)]
        assert np.allclose(slopes[..., axis], (moved[0] - moved[1]) / 2e-6, rtol=1e-5, atol=1e-4)


def test_a_camera_is_located_among_outliers() -> None:
    """A third of the observations is anywhere, some have no disparity; the pose is exact and the outliers are named."""
    pose = SE3.of(np.array([0.05, -0.1, 0.02, 0.1, 0.05, -0.3]))
    seen = OBSERVATION.projected(pose.apply(points(90)))
    seen[:30, :2] += np.random.default_rng(1).uniform(15, 60, (30, 2))
    seen[30:40, 2] = np.nan
    found = located(points(90), seen, OBSERVATION)
    assert found is not None
    assert distance(found.camera_world, pose).max() < 1e-6
    assert not found.inliers[:30].any()
    assert found.inliers[30:].all()


def test_no_pose_is_made_up() -> None:
    """Too few points, points without any common motion, and points on one line give none."""
    seen = OBSERVATION.projected(points(60))
    line = np.outer(np.linspace(1, 3, 60), [0.1, 0.1, 1.0])
    assert located(points(LEAST_INLIERS - 1), seen[: LEAST_INLIERS - 1], OBSERVATION) is None
    assert located(points(60), np.random.default_rng(2).uniform(0, 300, (60, 3)), OBSERVATION) is None
    assert located(line, OBSERVATION.projected(line), OBSERVATION) is None
    nowhere = refined(SE3.identity(), np.zeros((20, 3)), np.full((20, 3), np.nan), OBSERVATION)
    assert np.array_equal(nowhere.pose(), np.zeros(6))


def test_the_disparities_weigh_by_their_noise() -> None:
    """Pixels that speak for one pose and disparities that speak for another: the surer ones win."""
    wrong = OBSERVATION.projected(points(200))
    wrong[:, 2] += 0.5
    sure, unsure = (refined(SE3.identity(), points(200), wrong, Observer(GEOMETRY, noise)) for noise in (0.05, 5.0))
    assert distance(unsure, SE3.identity())[1] < 1e-3 < distance(sure, SE3.identity())[1]


@pytest.fixture
def keyframes() -> tuple[list[Keyframe], list[SE3]]:
    """Four keyframes that see 120 points, with noise of the pixels, a common error of the disparities and wrong starts."""
    random, truth = np.random.default_rng(7), path(4, np.array([0.01, 0.03, 0.0, 0.08, 0.0, 0.12]))
    made = []
    for index, pose in enumerate(truth):
        seen = OBSERVATION.projected(pose.inverse().apply(points(120) + np.array([0, 0, 1.0])))
        seen += random.normal(0, [0.05, 0.05, 0.05], seen.shape) + np.array([0, 0, 0.2])
        start = pose.inverse() if index == 0 else SE3.of(random.normal(0, 0.01, 6)) @ pose.inverse()
        made.append(Keyframe(index=index, camera_world=start, ids=np.arange(120), observed_px=seen))
    return made, truth


def test_a_window_finds_poses_points_and_the_common_error(keyframes: tuple[list[Keyframe], list[SE3]]) -> None:
    """Starts that are 1 cm off end within 4 mm; window by window two thirds of the disparities' common error of 0.2 px are found."""
    frames, truth = keyframes
    fit = fitted(frames, np.arange(0), np.zeros((0, 3)), Observer(GEOMETRY, 0.05), 1)
    for _ in range(40):
        fit = fitted(fit.keyframes, fit.ids, fit.points_m, Observer(GEOMETRY, 0.05, fit.offset_px), 1)
    for frame, pose in zip(fit.keyframes, truth, strict=True):
        assert distance(frame.camera_world.inverse(), pose).max() < 4e-3
    assert fit.offset_px == pytest.approx(0.2, abs=0.07)
    assert np.array_equal(fit.keyframes[0].camera_world.pose(), frames[0].camera_world.pose())


def test_a_window_without_common_points_leaves_all_as_it_was(keyframes: tuple[list[Keyframe], list[SE3]]) -> None:
    """Nothing is seen twice: poses, points and the error stay."""
    first, second = keyframes[0][:2]
    apart = [
        first,
        Keyframe(index=1, camera_world=second.camera_world, ids=second.ids + 1000, observed_px=second.observed_px),
    ]
    fit = fitted(apart, np.arange(0), np.zeros((0, 3)), OBSERVATION, 1)
    assert fit.keyframes == tuple(apart)
    assert np.array_equal(fit.updated(np.arange(3), np.ones((3, 3))), np.ones((3, 3)))


def test_corners_keep_their_distance_and_are_followed() -> None:
    """No new corner lies near a held one or where none is wanted; all are followed by the motion of the image."""
    grey = plane_view(SE3.identity(), PICTURE).grey
    wanted = np.zeros(grey.shape, np.bool_)
    wanted[:, 60:] = True
    held = np.array([[120.0, 90.0]], np.float32)
    found = new_corners(grey, held, 80, 9, wanted)
    assert 40 < len(found) < 80
    assert (np.linalg.norm(found - held, axis=1) > 8).all()
    assert (found[:, 0] >= 60).all()
    assert len(new_corners(grey, found, len(found), 9)) == 0
    assert len(new_corners(np.zeros_like(grey), held, 80, 9)) == 0
    inner = found[(found[:, 0] > 20) & (found[:, 0] < 220) & (found[:, 1] > 20) & (found[:, 1] < 160)]
    there, ok = followed(grey, np.roll(grey, (3, -5), (0, 1)), inner)
    assert ok.mean() > 0.9
    assert np.abs(there[ok] - inner[ok] - [-5, 3]).max() < 0.2
    assert followed(grey, grey, inner[:0])[1].shape == (0,)


@pytest.mark.parametrize("every", [1, 4])
def test_odometry_follows_a_camera(every: int) -> None:
    """Over 12 views of a plane the path of 17 cm is found to 2 mm, with a keyframe at each view or at each fourth."""
    truth = path(12, np.array([0.004, 0.01, -0.005, 0.012, -0.004, 0.009]))
    odometry = Odometry(OdometrySettings(corners=150, keyframe_after=every))
    moves = [odometry.step(plane_view(pose, PICTURE)) for pose in truth]
    assert all(moved.is_known for moved in moves)
    assert moves[-1].inliers > 60
    assert distance(moves[-1].world_camera, truth[-1]).max() < 2e-3
    assert len(odometry.poses()) == len(truth)
    assert all(distance(one, other).max() < 2e-3 for one, other in zip(odometry.poses(), truth, strict=True))
    assert abs(odometry.offset_px) < 0.1


def test_odometry_tells_what_it_does_not_know() -> None:
    """A black view and the one after it have no known motion; then it goes on from there."""
    truth, odometry = path(6, np.array([0.0, 0.01, 0.0, 0.012, 0.0, 0.0])), Odometry()
    views = [plane_view(pose, PICTURE if index != 2 else np.zeros_like(PICTURE)) for index, pose in enumerate(truth)]
    moves = [odometry.step(view) for view in views]
    assert [moved.is_known for moved in moves] == [True, True, False, False, True, True]
    assert all(np.array_equal(moved.before_now.pose(), np.zeros(6)) for moved in moves[2:4])
    assert distance(moves[4].before_now, SE3.of(truth[1].pose())).max() < 2e-3
    assert len(odometry.poses()) == 6


def test_half_a_depth_is_every_second_pixel() -> None:
    """A point's pixel in the half image shows the depth of the whole one; odd sizes round up."""
    view = plane_view(SE3.identity(), PICTURE)
    half, geometry = halved(view.depth_m[:-1], view.geometry)
    assert half.shape == (90, 120)
    assert half[10, 20] == view.depth_m[20, 40]
    assert geometry.focal_px * geometry.baseline_m / (5 - geometry.doffs_px) == pytest.approx(
        view.geometry.focal_px * view.geometry.baseline_m / (10 - view.geometry.doffs_px)
    )
    assert view.noise_per_m == pytest.approx(0.1 / 20)


def test_a_reduced_view_shows_the_same_points() -> None:
    """A wide view loses half its size; a point lies where the average of four pixels does. A small one stays as it is."""
    small = plane_view(SE3.identity(), PICTURE)
    wide = replace(
        small,
        grey=np.tile(small.grey, (2, 3)),
        colours=np.tile(small.colours, (2, 3, 1)),
        depth_m=np.tile(small.depth_m, (2, 3)),
    )
    half = reduced(wide)
    assert half.grey.shape == half.depth_m.shape == (180, 360)
    assert half.grey[10, 20] == pytest.approx(wide.grey[20:22, 40:42].mean(), abs=0.51)
    slope = (40.5 - wide.geometry.cx_px) / wide.geometry.focal_px
    assert (20 - half.geometry.cx_px) / half.geometry.focal_px == pytest.approx(slope)
    assert half.noise_per_m == pytest.approx(wide.noise_per_m)
    assert reduced(small) is small
