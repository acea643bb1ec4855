"""Rendered scenes: the truth agrees with geometry done by hand, and the images agree with the truth."""

import math
from dataclasses import replace
from pathlib import Path as FilePath

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from common.errors import UnavailableError
from phone_host.model import RectifiedPair, StereoGeometry
from phone_host.scene.cast import pixel_rays, project
from phone_host.scene.film import Film, render_film
from phone_host.scene.scene import (
    DEMO_PERIOD_S,
    PHONE_LOOK,
    WEBCAM_LOOK,
    demo_scene,
    rectified_cameras,
    truth,
    unlike_rig,
)
from phone_host.scene.scene_model import (
    Body,
    Box,
    Look,
    Path,
    Plane,
    Pose,
    RectifiedView,
    Scene,
    Sphere,
    Texture,
    rig_poses,
    rotation,
)
from phone_host.scene.scene_render import Renderer, render
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.rectifier import Rectifier
from tests.support.plain_scenes import matched_view, plane_scene
from tests.support.rigs import narrow_rig, small_rig

SMALL_VIEW = RectifiedView(StereoGeometry(focal_px=200.0, baseline_m=0.1, cx_px=79.5, cy_px=59.5), 160, 120)
FOCAL_PX, BASELINE_M = 525.0, 0.1

depths = st.floats(0.4, 5.0)
tilts = st.floats(-0.9, 0.9)


def grey(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float32)


@settings(deadline=None, max_examples=25)
@given(depth=depths, tilt=tilts)
def test_plane_has_the_depth_of_the_formula(depth: float, tilt: float) -> None:
    """A plane through (0, 0, z0) turned by `tilt` about y intersects the ray (x, y, 1) at z0 / (1 + x tan(tilt))."""
    # A plane whose normal is (sin a, 0, cos a): x z sin a + (z - z0) cos a = 0.
    found = truth(plane_scene(depth, tilt), SMALL_VIEW)
    slope = (np.arange(160) - 79.5) / 200.0
    expected = depth / (1.0 + slope * math.tan(tilt))
    assert np.allclose(found.depth_m, expected[None, :], rtol=1e-12)
    assert np.allclose(found.disparity_px, 200.0 * 0.1 / expected[None, :], rtol=1e-12)


@settings(deadline=None, max_examples=25)
@given(x=st.floats(-0.3, 0.3), y=st.floats(-0.2, 0.2), z=st.floats(0.6, 3.0), radius=st.floats(0.05, 0.3))
def test_sphere_is_nearest_where_its_centre_is_seen(x: float, y: float, z: float, radius: float) -> None:
    """The ray towards a ball's centre hits it one radius before the centre, and rays just outside its outline miss it."""
    scene = Scene((Body("ball", Sphere(radius), (x, y, z)),))
    centre = np.array([x, y, z])
    distance = float(np.linalg.norm(centre))
    turn = np.linalg.inv(np.column_stack(frame_with_third(centre / distance)))
    view = RectifiedView(StereoGeometry(focal_px=200.0, baseline_m=0.1, cx_px=80.0, cy_px=60.0), 161, 121, turn)
    found = truth(scene, view)
    assert found.depth_m[60, 80] == pytest.approx(distance - radius, rel=1e-12)
    # The outline is at the angle asin(r / distance); (u, v) is that angle's tangent away from the middle.
    v, u = np.mgrid[-60:61, -80:81] / 200.0
    outline = math.tan(math.asin(radius / distance))
    angle = np.hypot(u, v)
    clear = np.abs(angle - outline) > 1e-12  # a ray exactly along the outline may round either way
    assert np.array_equal(found.background[clear], (angle > outline)[clear])


def frame_with_third(z: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z


def test_box_shows_its_front_face() -> None:
    """A box in front of the camera covers exactly the pixels of its front face, at the face's depth."""
    scene = Scene((Body("box", Box((0.4, 0.3, 0.2)), (0.0, 0.0, 1.1)),))
    found = truth(scene, SMALL_VIEW)
    # Front face at z = 1.0: half sizes of 0.2 and 0.15 m are 40 and 30 px around (79.5, 59.5).
    inside = np.zeros((120, 160), dtype=bool)
    inside[30:90, 40:120] = True
    assert np.array_equal(~found.background, inside)
    assert np.allclose(found.depth_m[inside], 1.0, rtol=1e-12)


def test_occluded_strip_is_as_wide_as_the_disparities_differ() -> None:
    """Left of a box in front of a wall, the strip that only the left camera sees is d(box) - d(wall) pixels wide."""
    scene = Scene((Body("wall", Plane(), (0.0, 0.0, 2.0)), Body("box", Box((0.4, 0.3, 0.2)), (0.0, 0.0, 1.1))))
    found = truth(scene, SMALL_VIEW)
    # d(box) = 200 * 0.1 / 1 = 20 px, d(wall) = 10 px; the box's left edge is at x = 39.5, and its side faces away.
    row = 60
    assert np.array_equal(np.flatnonzero(found.hidden[row]), np.arange(30, 40))
    # The wall left of x = 10 is outside the right image; nothing else is lost.
    assert np.array_equal(np.flatnonzero(~found.visible[row]), np.concatenate([np.arange(10), np.arange(30, 40)]))
    assert found.body[row, 35] == 0
    assert found.body[row, 60] == 1


@pytest.mark.parametrize("t_s", [0.0, 1.7])
def test_left_and_right_truth_agree(t_s: float) -> None:
    """A left pixel moved by its disparity is on a right ray whose own first hit is the same point."""
    scene = demo_scene().at(t_s)
    rig = unlike_rig()
    rectifier = Rectifier(rig).rectification
    view = RectifiedView(rectifier.geometry, rectifier.width_px, rectifier.height_px, rectifier.R_left)
    found = truth(scene, view)
    (_, _), (_, right_pose) = rectified_cameras(view)
    v, u = np.nonzero(found.visible)
    chosen = np.random.default_rng(5).choice(v.size, 40, replace=False)
    for y, x in zip(v[chosen], u[chosen], strict=True):
        # A right camera of one pixel; its only ray passes through (x - d, y).
        geometry = view.geometry
        x_right = x - found.disparity_px[y, x]
        matrix = np.array(
            [[geometry.focal_px, 0.0, geometry.cx_px - x_right], [0.0, geometry.focal_px, geometry.cy_px - y]]
        )
        eye = RectifiedView(
            StereoGeometry(
                focal_px=geometry.focal_px, baseline_m=geometry.baseline_m, cx_px=matrix[0, 2], cy_px=matrix[1, 2]
            ),
            1,
            1,
            view.R_rectified_left,
        )
        moved = Scene(
            tuple(
                replace(body, position_m=tuple(np.asarray(body.position_m) - right_pose.centre_m))
                for body in scene.bodies
            )
        )
        assert truth(moved, eye).depth_m[0, 0] == pytest.approx(found.depth_m[y, x], rel=1e-9)


def test_unlike_cameras_are_unlike() -> None:
    """The demo's cameras differ in size, focal length and distortion, are 100 mm apart and are turned by 1 to 2 degrees."""
    rig = unlike_rig()
    assert (rig.left.width_px, rig.left.height_px) != (rig.right.width_px, rig.right.height_px)
    assert rig.right.matrix[0, 0] / rig.left.matrix[0, 0] > 1.2
    assert not np.allclose(rig.left.distortion, rig.right.distortion)
    assert np.linalg.norm(rig.t_right_left_m) == pytest.approx(0.1, rel=1e-12)
    angle = math.degrees(math.acos((np.trace(rig.R_right_left) - 1.0) / 2.0))
    assert 1.0 < angle < 2.0


@pytest.mark.parametrize("side", [0, 1])
def test_rays_undo_the_distortion(side: int) -> None:
    """Projecting a point on a pixel's ray gives that pixel within a millionth of a pixel, corners included."""
    rig = unlike_rig()
    model, pose = (rig.left, rig.right)[side], rig_poses(rig)[side]
    x, y = (np.linspace(0, size - 1, 80).astype(int) for size in (model.width_px, model.height_px))
    pixels = np.stack(np.meshgrid(x, y)).reshape(2, -1)
    rays = pixel_rays(model)[:, pixels[1], pixels[0]]
    points = pose.centre_m[:, None] + pose.R_camera_scene.T @ (1.3 * rays)
    assert np.max(np.abs(project(points, model, pose) - pixels)) < 1e-6


def test_points_behind_a_camera_have_no_pixel() -> None:
    """A point behind the camera is not visible."""
    model = rectified_cameras(SMALL_VIEW)[0][0]
    assert np.isnan(project(np.array([[0.0], [0.0], [-1.0]]), model, Pose())).all()


def test_images_of_both_cameras_show_the_same_surface() -> None:
    """Sampled through the truth, the right image equals the left within the interpolation error between its pixels."""
    scene = demo_scene().at(0.4)
    view = matched_view()
    found = truth(scene, view)
    left, right = (grey(render(scene, model, pose)) for model, pose in rectified_cameras(view))
    x, y = np.meshgrid(np.arange(640, dtype=np.float32), np.arange(480, dtype=np.float32))
    moved = cv2.remap(right, (x - found.disparity_px).astype(np.float32), y, cv2.INTER_CUBIC)
    # Pixels at the border of two surfaces mix both, so they are left out.
    core = cv2.erode(found.visible.astype(np.uint8), np.ones((5, 5), dtype=np.uint8)).astype(bool)
    core &= cv2.morphologyEx(found.body, cv2.MORPH_GRADIENT, np.ones((5, 5), dtype=np.uint8)) == 0
    difference = np.abs(moved - left)[core]
    assert np.median(difference) < 1.5
    assert np.percentile(difference, 95) < 8.0
    # The same comparison half a pixel off is far worse: the images have detail, and it is in the right place.
    aside = cv2.remap(right, (x - found.disparity_px + 0.5).astype(np.float32), y, cv2.INTER_CUBIC)
    assert np.median(np.abs(aside - left)[core]) > 2.5 * np.median(difference)


def test_each_camera_of_the_unlike_rig_sees_points_where_they_project() -> None:
    """The centre of light of a small bright ball on a dark wall is where the ball's centre projects, in both cameras."""
    rig = unlike_rig()
    plain = Texture(light_bgr=(0.0, 0.0, 0.0), dark_bgr=(0.0, 0.0, 0.0))
    white = Texture(light_bgr=(1.0, 1.0, 1.0), dark_bgr=(1.0, 1.0, 1.0), contrast=0.0)
    for place in ((-0.25, 0.18, 1.0), (0.3, -0.2, 1.2)):
        scene = Scene((Body("wall", Plane(), (0.0, 0.0, 3.0), plain), Body("ball", Sphere(0.02), place, white)))
        for model, pose in zip((rig.left, rig.right), rig_poses(rig), strict=True):
            # The lamp is behind each camera, so that the whole disc is lit equally.
            light = replace(scene.light, lamp_bgr=(0.0, 0.0, 0.0), sky_bgr=(1.0, 1.0, 1.0))
            image = grey(render(replace(scene, light=light, void_bgr=(0.0, 0.0, 0.0)), model, pose))
            y, x = np.nonzero(image > 60)
            expected = project(np.array([place]).T, model, pose)[:, 0]
            # A ball's image is an ellipse whose centre is within r^2 tan / f of the image of the ball's centre: below 0.1 px here.
            assert np.hypot(x.mean() - expected[0], y.mean() - expected[1]) < 0.25


def test_sensors_limit_what_counts_as_visible() -> None:
    """If the real cameras are given, visible points project inside both images; other points are not visible."""
    rig = unlike_rig()
    sensors = tuple(zip((rig.left, rig.right), rig_poses(rig), strict=True))
    view = RectifiedView(StereoGeometry(focal_px=262.5, baseline_m=0.1, cx_px=224.5, cy_px=174.5), 450, 350)
    free, limited = truth(plane_scene(1.0), view), truth(plane_scene(1.0), view, sensors)
    assert not np.any(limited.visible & ~free.visible)
    assert 0.3 < limited.visible.sum() / free.visible.sum() < 0.8
    v, u = np.nonzero(limited.visible)
    points = np.stack([(u - 224.5) / 262.5, (v - 174.5) / 262.5, np.ones(u.size)])
    for model, pose in sensors:
        x, y = project(points, model, pose)
        assert x.min() >= 0.0
        assert y.min() >= 0.0
        assert x.max() <= model.width_px - 1
        assert y.max() <= model.height_px - 1


def test_doffs_shifts_disparity_and_right_camera() -> None:
    """With a doffs, z = f b / (d + doffs) holds and the right image still shows the point at x - d."""
    view = replace(SMALL_VIEW, geometry=replace(SMALL_VIEW.geometry, doffs_px=4.0))
    found = truth(plane_scene(1.0), view)
    assert np.allclose(found.disparity_px, 20.0 - 4.0)
    (left, left_pose), (right, right_pose) = rectified_cameras(view)
    point = np.array([[0.05], [0.02], [1.0]])
    shift = project(point, left, left_pose) - project(point, right, right_pose)
    assert shift[:, 0] == pytest.approx([16.0, 0.0])


@pytest.mark.parametrize("t_s", [0.0, 0.5, 3.0, 7.9])
def test_bodies_follow_their_paths(t_s: float) -> None:
    """At time t a body is at rest + a sin(2 pi t / T + phase) and has turned by rate * t about its axis."""
    path = Path(
        amplitude_m=(0.1, 0.0, 0.2),
        phase_rad=(0.0, 0.0, math.pi / 2.0),
        period_s=4.0,
        spin_axis=(0.0, 1.0, 0.0),
        spin_rad_s=0.5,
    )
    body = Body("box", Box((0.1, 0.1, 0.1)), (0.0, 0.0, 1.0), path=path).at(t_s)
    angle = 2.0 * math.pi * t_s / 4.0
    assert body.position_m == pytest.approx((0.1 * math.sin(angle), 0.0, 1.0 + 0.2 * math.cos(angle)))
    turn = 0.5 * t_s
    assert body.R_scene_body @ [1.0, 0.0, 0.0] == pytest.approx([math.cos(turn), 0.0, -math.sin(turn)])


def test_texture_moves_with_its_body() -> None:
    """A ball looks the same to a camera that moves with it, up to rounding: light and texture move with it."""
    model = rectified_cameras(SMALL_VIEW)[0][0]
    first = Scene((Body("ball", Sphere(0.2), (0.0, 0.0, 1.0)),))
    second = Scene((Body("ball", Sphere(0.2), (0.25, -0.125, 1.5)),))
    here = render(first, model).astype(int)
    there = render(second, model, Pose(np.eye(3), np.array([0.25, -0.125, 0.5]))).astype(int)
    assert np.max(np.abs(here - there)) <= 1


def test_film_equals_single_renders() -> None:
    """A frame of a film, with its cached background, equals the scene rendered from scratch for that time."""
    rig = small_rig()
    pose = rig_poses(rig)[0]
    film = Renderer(demo_scene(), rig.left, pose)
    film.frame(3.3)
    frame = film.frame(1.1).astype(int)
    single = render(demo_scene(), rig.left, pose, t_s=1.1).astype(int)
    assert np.max(np.abs(frame - single)) <= 1


def test_film_is_repeatable_and_periodic() -> None:
    """Equal arguments give equal bytes, noise included; after one period the scene is the same again."""
    rig = small_rig()
    pose = rig_poses(rig)[1]
    one, two = (Renderer(demo_scene(), rig.right, pose, PHONE_LOOK) for _ in range(2))
    assert np.array_equal(one.frame(0.8), two.frame(0.8))
    assert not np.array_equal(one.frame(0.8), one.frame(0.9))
    start, end = demo_scene().at(0.3), demo_scene().at(0.3 + DEMO_PERIOD_S)
    for before, after in zip(start.bodies, end.bodies, strict=True):
        assert before.position_m == pytest.approx(after.position_m, abs=1e-12)
        assert before.R_scene_body == pytest.approx(after.R_scene_body, abs=1e-12)


def test_look_is_the_curve_it_says() -> None:
    """Gain, offset, gamma and noise act as 255 * gain * light ** (1 / gamma) + offset + noise."""
    model = rectified_cameras(SMALL_VIEW)[0][0]
    void = Scene((), void_bgr=(0.25, 0.25, 0.25))
    look = Look(gain_bgr=(0.5, 1.0, 1.2), offset=5.0)
    # sqrt(0.25) = 0.5.
    assert np.array_equal(np.unique(render(void, model, look=look).reshape(-1, 3), axis=0), [[69, 132, 158]])
    noisy = render(void, model, look=replace(look, noise_sigma=3.0, seed=4)).astype(float)
    assert noisy.std(axis=(0, 1)) == pytest.approx([3.0, 3.0, 3.0], rel=0.1)
    cubic = render(void, model, look=Look(gamma=3.0))
    assert np.unique(cubic).tolist() == [round(255.0 * 0.25 ** (1.0 / 3.0))]
    dark_corner = render(void, model, look=Look(vignetting=0.36))
    # Corner: 0.25 * (1 - 0.36) = 0.16, its root 0.4.
    assert dark_corner[0, 0, 0] == round(255.0 * 0.4)


def test_texture_does_not_alias() -> None:
    """Moving the camera by half a pixel changes a wall's image as a shift does: there is no detail finer than pixels can hold."""
    view = matched_view()
    model, _ = rectified_cameras(view)[0]
    scene = plane_scene(2.0)
    here = grey(render(scene, model))
    # Half a pixel at 2 m is 2 / 525 / 2 m.
    there = grey(render(scene, model, Pose(np.eye(3), np.array([2.0 / FOCAL_PX / 2.0, 0.0, 0.0]))))
    spectrum = np.fft.rfft(here, axis=1) * np.exp(2j * np.pi * np.fft.rfftfreq(640) * 0.5)
    shifted = np.fft.irfft(spectrum, 640, axis=1)
    rms = float(np.sqrt(np.mean((shifted - there)[:, 40:-40] ** 2)))
    assert rms < 0.05 * float(here.std())


def test_texture_is_rich_on_every_body() -> None:
    """On every body of the demo the image has detail in nearly every window of 9 x 9 pixels."""
    scene, view = demo_scene(), matched_view()
    found = truth(scene, view)
    model, pose = rectified_cameras(view)[0]
    image = grey(render(scene, model, pose))
    mean, square = cv2.blur(image, (9, 9)), cv2.blur(image * image, (9, 9))
    deviation = np.sqrt(np.maximum(square - mean * mean, 0.0))
    for index, body in enumerate(scene.bodies):
        assert np.percentile(deviation[found.body == index], 5) > 3.0, body.name


@pytest.mark.parametrize("tilt_rad", [0.0, 0.3])
@pytest.mark.parametrize(("depth_m", "limit"), [(1.0, 0.003), (2.0, 0.006)])
def test_default_matcher_measures_planes_of_unlike_cameras(depth_m: float, limit: float, tilt_rad: float) -> None:
    """Noise-free planes seen by the demo's unlike cameras: median |disparity error| <= 0.15 px, depth within 0.3 % at 1 m, 0.6 % at 2 m."""
    # At 1 m the plane that faces the camera has a disparity of 52.5 px, between two pixels; the turned one has all fractions.
    error_px, relative = errors_of_default_matcher(plane_scene(depth_m, tilt_rad), (Look(), Look()))
    assert error_px <= 0.15
    assert relative <= limit


def test_default_matcher_measures_the_demo() -> None:
    """The demo's scene with the sensors' noise, offset and gain: median |disparity error| <= 0.15 px."""
    assert errors_of_default_matcher(demo_scene().at(0.7), (WEBCAM_LOOK, PHONE_LOOK))[0] <= 0.15


def errors_of_default_matcher(scene: Scene, looks: tuple[Look, Look]) -> tuple[float, float]:
    rig = narrow_rig()
    rectifier = Rectifier(rig)
    cameras = tuple(zip((rig.left, rig.right), rig_poses(rig), strict=True))
    left, right = (render(scene, model, pose, look) for (model, pose), look in zip(cameras, looks, strict=True))
    pair: RectifiedPair = rectifier.rectify(left, right)
    disparity = create_matcher(MatchSettings(disparities=96)).match(pair)
    made = rectifier.rectification
    view = RectifiedView(made.geometry, made.width_px, made.height_px, made.R_left)
    found = truth(scene, view, cameras)
    both = found.visible & np.isfinite(disparity) & (disparity > 0.0)
    assert both.sum() > 0.95 * found.visible.sum()
    error = np.abs(disparity - found.disparity_px)[both]
    depth = made.geometry.focal_px * made.geometry.baseline_m / disparity[both]
    return float(np.median(error)), float(np.median(np.abs(depth / found.depth_m[both] - 1.0)))


def test_rotation_is_right_handed() -> None:
    """A quarter turn about y takes z to x."""
    assert rotation((0.0, 2.0, 0.0), math.pi / 2.0) @ [0.0, 0.0, 1.0] == pytest.approx([1.0, 0.0, 0.0])


def test_finite_plane_is_seen_only_where_it_is() -> None:
    """A plane of 0.4 x 0.2 m at 1 m covers 80 x 40 pixels at f = 200 px; the rest is background."""
    scene = Scene((Body("card", Plane(0.4, 0.2), (0.0, 0.0, 1.0)),))
    assert (~truth(scene, SMALL_VIEW).background).sum() == 80 * 40


def test_a_poster_that_moves_close_by_is_drawn_as_if_it_stood_there() -> None:
    """A wide moving plane, so near that its bounding ball holds the camera, gives the same frame as a still one in its place; planes cast no shadows."""
    base = Scene((Body("wall", Plane(), (0.0, 0.0, 2.5)), Body("ball", Sphere(0.2), (0.3, 0.2, 1.6))))
    swing = Path(
        amplitude_m=(0.1, 0.05, 0.0), phase_rad=(0.0, 0.0, 0.0), period_s=2.0, spin_axis=(0.0, 1.0, 0.0), spin_rad_s=0.0
    )
    scene = replace(base, bodies=(*base.bodies, Body("poster", Plane(2.4, 0.2), (-0.2, -0.1, 1.0), path=swing)))
    camera, pose = rectified_cameras(SMALL_VIEW)[0]
    film = Renderer(scene, camera, pose)
    for t_s in (0.2, 0.5):
        difference = np.abs(film.frame(t_s).astype(int) - render(scene.at(t_s), camera, pose).astype(int))
        assert difference.max() <= 1
    assert (film.frame(0.5) != film.frame(0.2)).any()


def test_a_film_is_refused_where_a_foreign_image_would_be_shown_with_it(tmp_path: FilePath) -> None:
    """An image that the film will not replace ends the rendering before it begins; the film's own images and other files do not."""
    foreign = tmp_path / "left" / "holiday.JPG"
    foreign.parent.mkdir()
    foreign.write_bytes(b"mine")
    scene, looks = plane_scene(1.0, 0.0), (WEBCAM_LOOK, PHONE_LOOK)

    def film() -> Film:
        return render_film(scene, small_rig(), looks, tmp_path, fps=2, seconds=1.0, advance=lambda: None)

    with pytest.raises(UnavailableError, match=r"holiday\.JPG is no image of the film"):
        film()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["holiday.JPG", "left"]
    foreign.rename(tmp_path / "left" / "notes.txt")
    film()
    film()
    assert sorted(path.name for path in (tmp_path / "left").iterdir()) == ["0.jpg", "1.jpg", "notes.txt"]
