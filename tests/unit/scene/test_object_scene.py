"""Rendered things on a mat: the mat is where it projects, the truth about the surface agrees with rays and with formulas."""

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import CameraModel, Image, Side
from phone_host.scene.cast import cast, pixel_rays, project
from phone_host.scene.distance import nearest_on
from phone_host.scene.object_scene import (
    BASELINE_M,
    MAT,
    RING_M,
    Motion,
    ObjectScene,
    Setting,
    Size,
    object_scene,
)
from phone_host.scene.scene_model import Body, Box, Frustum, Plane, Pose, Scene, Shape, Sphere, Texture, Torus, rotation
from phone_host.scene.scene_render import render
from phone_host.scene.solid import OBJECTS, Solid, samples_of
from tests.support.plain_scenes import mat_corners_m

ROUND = (Frustum(0.03, 0.01, 0.05), Frustum(0.02, 0.02, 0.04), Frustum(0.03, 0.0, 0.06), Torus(0.03, 0.008))
SHAPES = (*ROUND, Sphere(0.03), Box((0.05, 0.03, 0.004)))


def charuco_corners(image: Image) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """What OpenCV finds: numbers (N,) and places (N, 2) px."""
    squares = MAT.squares
    dictionary = cv2.aruco.getPredefinedDictionary(MAT.family.value)
    board = cv2.aruco.CharucoBoard(
        (squares.columns, squares.rows), squares.square_mm / 1000.0, MAT.mark_mm / 1000.0, dictionary
    )
    found, numbers, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
    assert numbers is not None
    return np.asarray(numbers, np.int32).ravel(), np.asarray(found, np.float64).reshape(-1, 2)


def projected(scene: ObjectScene, number: int, side: Side, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where points of the mat's axes are seen, (N, 2) px, by OpenCV's own projection."""
    pose = np.linalg.inv(scene.pose(number))
    model, turned, moved = scene.rig.left, pose[:3, :3], pose[:3, 3]
    if side is Side.RIGHT:
        model, between = scene.rig.right, scene.rig.R_right_left
        turned, moved = between @ turned, between @ moved + scene.rig.t_right_left_m
    turn = np.asarray(cv2.Rodrigues(turned)[0])
    seen = cv2.projectPoints(points_m, turn, moved, model.matrix, model.distortion)[0]
    return np.asarray(seen, np.float64).reshape(-1, 2)


@pytest.mark.parametrize(("size", "motion"), [(Size.VGA, Motion.RIG), (Size.VGA, Motion.MAT), (Size.HD, Motion.RIG)])
def test_the_mat_is_found_where_it_projects(size: Size, motion: Motion) -> None:
    """OpenCV finds most of the corners that the thing does not hide, with their numbers, a tenth of a pixel off at the median, in both images."""
    scene = object_scene("speckled", Setting(size=size, motion=motion))
    view = scene.view(5)
    for side, model, image in ((Side.LEFT, scene.rig.left, view.left), (Side.RIGHT, scene.rig.right, view.right)):
        assert image.shape == (model.height_px, model.width_px, 3)
        numbers, places = charuco_corners(image)
        off = np.linalg.norm(places - projected(scene, 5, side, mat_corners_m()[numbers]), axis=1)
        assert numbers.size >= 15
        assert np.median(off) < 0.1


def test_a_perfect_camera_finds_the_mat_without_a_bias() -> None:
    """Without noise and compression the corners lie where they project, to a fortieth of a pixel on average."""
    looks = tuple(type(look)(blur_px=0.6) for look in Setting().looks)
    scene = object_scene("thin", Setting(size=Size.HD, jpeg_quality=None, looks=(looks[0], looks[1])))
    off = []
    for number in (0, 13):
        numbers, places = charuco_corners(scene.view(number).left)
        off.append(places - projected(scene, number, Side.LEFT, mat_corners_m()[numbers]))
    assert np.abs(np.median(np.concatenate(off), axis=0)).max() < 0.025
    # A corner that the thing touches is found elsewhere.
    assert np.percentile(np.linalg.norm(np.concatenate(off), axis=1), 80) < 0.1


def test_a_view_is_the_same_every_time_and_each_has_its_noise() -> None:
    """Two scenes with equal settings give equal bytes; another seed gives other noise."""
    small = Setting(views=12)
    first, again = (object_scene("shiny", small).view(3) for _ in range(2))
    assert first.left.tobytes() == again.left.tobytes()
    assert first.right.tobytes() == again.right.tobytes()
    assert np.array_equal(first.T_mat_left, again.T_mat_left)
    other = object_scene("shiny", Setting(views=12, seed=1, motion=Motion.MAT)).view(3)
    assert other.left.tobytes() != first.left.tobytes()


def test_rig_and_mat_move_alike_seen_from_the_mat() -> None:
    """Without a shaking hand, a rig that goes around and a mat that turns give the same poses; the cameras are 60 mm apart on a ring of 0.42 m."""
    rig, mat = (object_scene("plain", Setting(motion=motion, shake_m=0.0)) for motion in Motion)
    beside = -rig.rig.R_right_left.T @ rig.rig.t_right_left_m
    assert np.linalg.norm(beside) == pytest.approx(BASELINE_M)
    for number in (0, 7, 20):
        assert np.allclose(rig.pose(number), mat.pose(number), atol=1e-12)
        pose = rig.pose(number)
        middle = pose[:3, 3] + pose[:3, :3] @ beside / 2.0
        assert np.linalg.norm(middle - [0.0, 0.0, 0.035]) == pytest.approx(RING_M)
        scene, left, _ = mat.scene(number)
        sheet = next(body for body in scene.bodies if body.name == "mat")
        # The mat's axes, where the scene has put them, and the camera's give the pose back.
        mat_in_scene = np.eye(4)
        mat_in_scene[:3, :3], mat_in_scene[:3, 3] = sheet.R_scene_body, sheet.position_m
        left_in_scene = np.eye(4)
        left_in_scene[:3, :3], left_in_scene[:3, 3] = left.R_camera_scene.T, left.centre_m
        assert np.allclose(np.linalg.inv(mat_in_scene) @ left_in_scene, mat.pose(number), atol=1e-12)


@pytest.mark.parametrize("name", OBJECTS)
def test_what_a_ray_hits_is_on_the_surface(name: str) -> None:
    """Every point that a ray hits first has no distance from the surface, and half a millimetre before it, it is at most that far away."""
    solid = object_scene(name).solid
    rng = np.random.default_rng(3)
    for _ in range(4):
        away = rng.standard_normal(3)
        origin = np.array([0.0, 0.0, 0.05]) + 0.4 * away / np.linalg.norm(away)
        target = np.stack([rng.uniform(-0.04, 0.04, 3000), rng.uniform(-0.04, 0.04, 3000), rng.uniform(0, 0.1, 3000)])
        rays = target - origin[:, None]
        rays /= np.linalg.norm(rays, axis=0)
        depth = cast(solid.parts, origin, rays).depth
        hit = np.isfinite(depth)
        assert hit.mean() > 0.3
        points = origin[:, None] + depth[hit] * rays[:, hit]
        assert np.abs(solid.signed_distance(points.T)).max() < 1e-8
        before = solid.signed_distance((points - 0.0005 * rays[:, hit]).T)
        assert before.min() > 0.0
        assert before.max() <= 0.0005 + 1e-12


@pytest.mark.parametrize("name", OBJECTS)
def test_the_distance_is_that_of_the_nearest_sample(name: str) -> None:
    """Inside and outside, the distance is that of the nearest of densely spread samples, within half of their spacing."""
    solid = object_scene(name).solid
    samples = solid.surface(0.0007)
    points = np.random.default_rng(4).uniform((-0.05, -0.05, -0.005), (0.05, 0.05, 0.115), (400, 3))
    told = solid.signed_distance(points)
    assert (told < 0).sum() > 15
    for point, distance in zip(points, told, strict=True):
        nearest = float(np.linalg.norm(samples.points - point[:, None], axis=0).min())
        assert abs(distance) <= nearest + 1e-5
        assert nearest <= abs(distance) + 0.0006
    assert np.abs(solid.signed_distance(samples.points.T)).max() < 1e-8
    outside = samples.points + 0.0002 * samples.normals
    assert (solid.signed_distance(outside.T) > 0).mean() > 0.99


def test_volumes_and_areas_are_those_of_the_formulas() -> None:
    """Single shapes have the volume and the area that geometry says; two overlapping balls lose their lens."""
    for shape, volume, area in (
        (Frustum(0.03, 0.01, 0.05), math.pi * 0.05 / 3 * (0.0009 + 0.0003 + 0.0001), None),
        (Torus(0.03, 0.008), 2 * math.pi**2 * 0.03 * 0.008**2, 4 * math.pi**2 * 0.03 * 0.008),
        (Sphere(0.03), 4 / 3 * math.pi * 0.03**3, 4 * math.pi * 0.03**2),
        (Box((0.05, 0.03, 0.02)), 0.05 * 0.03 * 0.02, 2 * (0.0015 + 0.001 + 0.0006)),
    ):
        solid = Solid((Body("it", shape, (0.01, 0.02, 0.03), R_scene_body=rotation((1.0, 2.0, 0.5), 0.7)),))
        assert solid.volume_m3(0.001) == pytest.approx(volume, rel=0.003)
        side = math.hypot(0.05, 0.02)
        told = area or math.pi * (0.0009 + 0.0001 + (0.03 + 0.01) * side)
        assert solid.surface(0.001).areas_m2.sum() == pytest.approx(told, rel=0.003)
    radius, apart = 0.03, 0.04
    two = Solid(tuple(Body("ball", Sphere(radius), (x, 0.0, 0.0)) for x in (0.0, apart)))
    lens = math.pi / 12 * (4 * radius + apart) * (2 * radius - apart) ** 2
    assert two.volume_m3(0.001) == pytest.approx(2 * 4 / 3 * math.pi * radius**3 - lens, rel=0.003)
    # In the middle between them, the surface is nearest at the seam: a circle around the line through both.
    assert two.signed_distance(np.array([[apart / 2, 0.0, 0.0]])) == pytest.approx(
        [-math.sqrt(radius**2 - (apart / 2) ** 2)], rel=1e-5
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_rays_meet_a_shape_where_its_surface_is(shape: Shape) -> None:
    """From any side, rays towards samples of the surface hit it, at the sample or before, on its surface; those that miss its ball miss it."""
    body = Body("it", shape, (0.0, 0.0, 0.0))
    solid = Solid((body,))
    samples = samples_of(shape, 0.003)
    for eye in ((0.3, 0.1, 0.2), (-0.2, 0.3, -0.1), (0.0013, 0.001, 0.4), (0.35, 0.0007, 0.0003)):
        origin = np.array(eye)
        rays = samples.points - origin[:, None]
        facing = -(rays * samples.normals).sum(axis=0) / np.linalg.norm(rays, axis=0) > 0.05
        depth = cast((body,), origin, rays[:, facing]).depth
        assert (depth <= 1.0 + 1e-9).all()
        points = origin[:, None] + depth * rays[:, facing]
        assert np.abs(solid.signed_distance(points.T)).max() < 1e-9
        aside = np.cross(origin, [0.3, 0.5, 0.7])
        away = aside / np.linalg.norm(aside) * 1.05 * body.bounding_radius_m
        assert not np.isfinite(cast((body,), origin, (away - origin)[:, None]).depth).any()


def test_a_ray_through_the_hole_of_a_ring_misses_it() -> None:
    """Along the axis a ring lets rays through; its tube is hit at the height of its upper side."""
    ring = (Body("ring", Torus(0.03, 0.008), (0.0, 0.0, 0.0)),)
    rays = np.array([[0.0, 0.0, -1.0]] * 3).T
    for x, expected in ((0.0, math.inf), (0.021, math.inf), (0.03, 0.192), (0.039, math.inf)):
        depth = cast(ring, np.array([x, 0.0, 0.2]), rays).depth
        assert depth == pytest.approx(expected)


def test_gloss_shows_the_lamp_and_moves_with_the_camera() -> None:
    """A glossy ball is brighter than a matt one at one spot; the spot of a camera beside lies at another point of the ball."""
    model = CameraModel(
        width_px=200,
        height_px=200,
        matrix=np.array([[400.0, 0, 99.5], [0, 400.0, 99.5], [0, 0, 1]]),
        distortion=np.zeros(5),
    )
    spots = []
    for x in (0.0, 0.2):
        pose = Pose(rotation((0.0, 1.0, 0.0), math.atan2(x, 1.0)), np.array([x, 0.0, 0.0]))
        matt, shiny = (
            render(Scene((Body("ball", Sphere(0.15), (0.0, 0.0, 1.0), Texture(gloss=gloss)),)), model, pose)
            for gloss in (0.0, 0.8)
        )
        brighter = shiny.astype(int).sum(axis=2) - matt.astype(int).sum(axis=2)
        assert brighter.min() >= 0
        v, u = np.unravel_index(int(np.argmax(brighter)), brighter.shape)
        ray = pose.R_camera_scene.T @ pixel_rays(model)[:, v, u]
        depth = cast((Body("ball", Sphere(0.15), (0.0, 0.0, 1.0)),), pose.centre_m, ray[:, None]).depth
        spots.append(pose.centre_m + depth[0] * ray)
    assert np.linalg.norm(spots[0] - spots[1]) > 0.008


def test_a_blur_spreads_the_light_and_keeps_it() -> None:
    """Blur spreads a small white square on black by its standard deviation; the light stays the same."""
    model = CameraModel(
        width_px=81, height_px=61, matrix=np.array([[100.0, 0, 40], [0, 100.0, 30], [0, 0, 1]]), distortion=np.zeros(5)
    )
    white = Texture(light_bgr=(0.9, 0.9, 0.9), dark_bgr=(0.9, 0.9, 0.9), contrast=0.0)
    scene = Scene((Body("square", Box((0.05, 0.05, 0.01)), (0.0, 0.0, 1.0), white),), void_bgr=(0.0, 0.0, 0.0))
    look = Setting().looks[0]
    sharp, soft = (
        render(scene, model, look=type(look)(gamma=2.0, blur_px=blur, gain_bgr=(0.7, 0.7, 0.7))).astype(float) ** 2
        for blur in (0.0, 2.0)
    )
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.02)

    def spread(light: NDArray[np.float64]) -> float:
        across = light.sum(axis=(0, 2))
        return float((across * (np.arange(81) - 40.0) ** 2).sum() / across.sum())

    assert math.sqrt(spread(soft) - spread(sharp)) == pytest.approx(2.0, rel=0.03)


def test_bare_table_and_all_around() -> None:
    """Without a mat there are no marks; after all views the rig is back where it began."""
    scene = object_scene("plain", Setting(has_mat=False, motion=Motion.MAT, views=9))
    assert not any(body.name == "mat" for body in scene.scene(0)[0].bodies)
    assert np.allclose(scene.pose(0), scene.pose(9), atol=1e-12)
    corner = mat_corners_m()[0]
    assert corner.tolist() == pytest.approx([-0.1, 0.075, 0.0])
    assert project(
        corner[:, None], scene.rig.left, Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.4]))
    ).shape == (2, 1)


def test_a_plane_is_no_solid() -> None:
    """It has no inside and no area: neither distances nor samples are made up."""
    with pytest.raises(ValueError, match="no inside"):
        nearest_on(Plane(), np.zeros((3, 1)))
    with pytest.raises(ValueError, match="no solid"):
        samples_of(Plane(), 0.01)


def test_a_distorted_camera_sees_nothing_behind_it() -> None:
    """Points that all lie behind the camera have no pixel; one ahead on the axis is at the principal point."""
    model = CameraModel(matrix=np.array([[500.0, 0, 320], [0, 500.0, 240], [0, 0, 1]]), distortion=np.array([0.1, 0, 0, 0, 0]), width_px=640, height_px=480)  # fmt: skip
    pose = Pose(np.eye(3), np.zeros(3))
    assert np.isnan(project(np.array([[0.0, 0.1], [0.0, 0.1], [-1.0, -2.0]]), model, pose)).all()
    assert project(np.array([[0.0], [0.0], [1.0]]), model, pose)[:, 0] == pytest.approx([320, 240])
