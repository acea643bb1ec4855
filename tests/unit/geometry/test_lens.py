"""How lenses project: against OpenCV, against their own inverse, and their derivatives against differences."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from phone_host.geometry.lens import (
    PARAMETERS,
    farthest_angle,
    parameters_of,
    project,
    project_linearised,
    rays_through,
    with_parameters,
)
from phone_host.model import CameraModel, Lens, Side
from phone_host.scene.cast import project as scene_project
from phone_host.scene.cast import rays_through as rays_of_scene
from phone_host.scene.scene_model import Pose, rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.evidence_points import ThroughRig
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_points, rectify_rig
from tests.support.plain_scenes import plane_scene
from tests.support.rigs import fisheye_rig, points_seen_by_both

_MATRIX = np.array([[410.0, 0, 322], [0, 408, 237], [0, 0, 1]])
_CAMERAS = {
    Lens.PINHOLE: np.array([-0.25, 0.08, 0.001, -0.0005, 0.01]),
    Lens.RATIONAL: np.array([0.9, 0.4, 0.001, -0.0005, 0.02, 1.1, 0.5, 0.06]),
    Lens.FISHEYE: np.array([-0.02, 0.004, -0.003, 0.0006]),
}


def camera(lens: Lens) -> CameraModel:
    return CameraModel(width_px=640, height_px=480, matrix=_MATRIX, distortion=_CAMERAS[lens], lens=lens)


def points(count: int = 200) -> NDArray[np.float64]:
    random = np.random.default_rng(3)
    depth = random.uniform(0.3, 2.0, count)
    return np.column_stack([random.uniform(-0.7, 0.7, (count, 2)) * depth[:, np.newaxis], depth])


@pytest.mark.parametrize("lens", Lens)
def test_pixels_are_opencvs(lens: Lens) -> None:
    """Each formula gives the pixels of OpenCV's function of that name."""
    model, nowhere = camera(lens), np.zeros((3, 1))
    if lens is Lens.FISHEYE:
        expected = cv2.fisheye.projectPoints(points()[:, np.newaxis], nowhere, nowhere, model.matrix, model.distortion)
    else:
        expected = cv2.projectPoints(points(), nowhere, nowhere, model.matrix, model.distortion)
    np.testing.assert_allclose(project(points(), model), expected[0].reshape(-1, 2), atol=1e-9)
    np.testing.assert_allclose(project_linearised(points(), model)[0], expected[0].reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("lens", Lens)
def test_derivatives_are_those_of_differences(lens: Lens) -> None:
    """Moving a point or a parameter by a little moves the pixel as the derivative says."""
    model, seen, step = camera(lens), points(40), 1e-6
    _, by_point, by_values = project_linearised(seen, model)
    for axis in range(3):
        move = np.eye(3)[axis] * step
        change = (project(seen + move, model) - project(seen - move, model)) / (2 * step)
        np.testing.assert_allclose(by_point[:, :, axis], change, atol=1e-4)
    count = 4 + len(model.distortion)
    for index in range(count):
        values = np.eye(PARAMETERS)[index] * step
        more, less = (project(seen, with_parameters(model, parameters_of(model) + way * values)) for way in (1, -1))
        np.testing.assert_allclose(by_values[:, :, index], (more - less) / (2 * step), atol=1e-4)


@pytest.mark.parametrize("lens", Lens)
def test_rays_lead_back_to_the_points(lens: Lens) -> None:
    """A pixel's ray is the direction of the point that it shows."""
    model, seen = camera(lens), points()
    rays = rays_through(project(seen, model), model)
    np.testing.assert_allclose(rays[:, :2] / rays[:, 2:], seen[:, :2] / seen[:, 2:], atol=1e-8)


@given(st.floats(0, 1.9), st.floats(0, 2 * np.pi))
def test_a_fisheye_lens_sees_behind_its_image_plane(angle: float, around: float) -> None:
    """Directions up to 109 degrees from the axis have a pixel, and the pixel's ray is that direction."""
    model = camera(Lens.FISHEYE)
    ray = np.array([[np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)]])
    np.testing.assert_allclose(rays_through(project(ray, model), model), ray, atol=1e-7)


def test_pixels_that_a_fisheye_lens_cannot_reach_have_no_ray() -> None:
    """Where the polynomial stops growing the lens's image ends; the middle has the ray of the axis."""
    model = replace(camera(Lens.FISHEYE), distortion=np.array([-0.3, 0.0, 0.0, 0.0]))
    assert farthest_angle(model) == pytest.approx(np.sqrt(1 / 0.9), abs=0.01)
    rays = rays_through(np.array([[322.0, 237.0], [2000.0, 237.0]]), model)
    np.testing.assert_allclose(rays[0], [0, 0, 1], atol=1e-12)
    assert np.isnan(rays[1]).all()
    assert rays_through(np.empty((0, 2)), model).shape == (0, 3)
    assert project(np.empty((0, 3)), model).shape == (0, 2)


def test_a_rig_of_a_fisheye_and_a_webcam_is_rectified() -> None:
    """Rows meet to 0.01 px and z = f b / d for every point that both cameras see inside the rectified image."""
    rig = fisheye_rig()
    rectification = rectify_rig(rig)
    geometry = rectification.geometry
    seen = points_seen_by_both(rig, 3000, seed=1)
    left = rectify_points(seen.left_px, rig.left, rectification.R_left, geometry)
    right = rectify_points(seen.right_px, rig.right, rectification.R_right, geometry)
    assert len(left) > 500
    assert np.abs(left[:, 1] - right[:, 1]).max() < 0.01
    depth = (seen.points_m @ rectification.R_left.T)[:, 2]
    found = geometry.focal_px * geometry.baseline_m / (left[:, 0] - right[:, 0])
    np.testing.assert_allclose(found, depth, rtol=1e-4)


def test_images_of_a_fisheye_camera_are_remapped_by_its_lens() -> None:
    """A camera's image whose value is its own column comes out with each pixel's column as the lens projects it."""
    rig = fisheye_rig()
    rectifier = Rectifier(rig)
    made = rectifier.rectification
    ramps = [np.tile((np.arange(m.width_px) % 256).astype(np.uint8), (m.height_px, 1)) for m in (rig.left, rig.right)]
    pair = rectifier.rectify(*ramps)
    x, y = np.meshgrid(np.arange(20, made.width_px - 20, 37), np.arange(20, made.height_px - 20, 29))
    geometry = made.geometry
    rays = np.column_stack([x.ravel() - geometry.cx_px, y.ravel() - geometry.cy_px, np.full(x.size, geometry.focal_px)])
    column = project(rays @ made.R_left, rig.left)[:, 0]
    inner = (column % 256 > 2) & (column % 256 < 253)
    found = pair.left[y.ravel(), x.ravel()].astype(float)
    assert np.abs(found - column % 256)[inner].max() < 1.0


def test_points_go_through_a_rig_of_such_lenses_and_back() -> None:
    """What the evidence of mistakes maps to the cameras' own images comes back to a thousandth of a pixel."""
    rig = fisheye_rig()
    made = rectify_rig(rig)
    maps = ThroughRig(rig, made)
    x, y = np.meshgrid(np.linspace(0, made.width_px - 1, 9), np.linspace(0, made.height_px - 1, 7))
    there = np.column_stack([x.ravel(), y.ravel()])
    for side in Side:
        np.testing.assert_allclose(maps.rectified(maps.own(there, side), side), there, atol=1e-3)


def test_a_wall_before_unlike_lenses_has_its_depth() -> None:
    """Rendered through a fisheye and a rational lens, rectified, matched and reprojected: the wall stands 1.5 m away."""
    rig = fisheye_rig()
    scene = plane_scene(1.5)
    left, right = (
        render(scene, model, pose) for model, pose in zip((rig.left, rig.right), rig_poses(rig), strict=True)
    )
    rectifier = Rectifier(rig)
    found = StereoCore(MatchSettings(), rectifier, wanted=DepthWanted(search_from_m=0.8)).compute(
        left, right, lambda: 0
    )
    assert found.cloud is not None
    depth = (found.cloud @ rectifier.rectification.R_left)[..., 2]
    assert np.isfinite(depth).mean() > 0.7
    assert np.nanmedian(np.abs(depth - 1.5)) < 0.015


def test_a_scene_is_projected_by_the_cameras_lens() -> None:
    """The ray through a pixel of a fisheye camera meets a point that is projected to that pixel."""
    model = camera(Lens.FISHEYE)
    x, y = np.array([10.0, 322.0, 600.0]), np.array([20.0, 237.0, 400.0])
    back = scene_project(rays_of_scene(model, x, y), model, Pose())
    np.testing.assert_allclose(back, [x, y], atol=1e-6)
