"""Rendered scenes with exact truth: textured planes, boxes and balls seen by two unlike cameras.

The demo, the tests and the benchmarks measure the product against them. Here are ready-made rigs and scenes, and the exact depth and
disparity. `scene_model` defines what a scene is, `cast` casts rays, `shade` computes colour, `scene_render` makes images.

Everything is float64 and taken at pixel centres, directly from the shapes; no image is involved.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel, Rig
from phone_host.scene.cast import FACES, cast, pixel_rays, project, rays_through
from phone_host.scene.scene_model import (
    Body,
    Box,
    Floats,
    Light,
    Look,
    Path,
    Plane,
    Pose,
    RectifiedView,
    Scene,
    Sphere,
    Texture,
    rotation,
)

# A point seen from the other camera is the nearest hit on its own ray, apart from rounding. 1e-9 of the distance is
# nanometres: a million times the rounding and far below any gap between two surfaces.
_SAME_POINT = 1e-9


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Truth:
    """The truth per pixel of the rectified left image, (H, W) each.

    Attributes:
        depth_m: float64 z in the rectified left camera's axes; NaN = the ray hits nothing.
        disparity_px: float64 left x - right x; NaN = nothing.
        visible: bool, both cameras see the surface point (not hidden, inside both images).
        hidden: bool, there is a surface, but another one hides it from the right camera.
        body: int16 index of the body in the scene; -1 = nothing.
    """

    depth_m: NDArray[np.float64]
    disparity_px: NDArray[np.float64]
    visible: NDArray[np.bool_]
    hidden: NDArray[np.bool_]
    body: NDArray[np.int16]

    @property
    def background(self) -> NDArray[np.bool_]:
        """Pixels whose ray hits nothing, (H, W) bool."""
        return self.body < 0


def rectified_cameras(view: RectifiedView) -> tuple[tuple[CameraModel, Pose], tuple[CameraModel, Pose]]:
    """Return the two ideal cameras of a rectified geometry; rendering both gives a perfectly rectified pair.

    Args:
        view: the rectified left camera and its geometry.

    Returns:
        (left camera, pose), (right camera, pose).
    """
    geometry = view.geometry
    matrix = np.array(
        [[geometry.focal_px, 0.0, geometry.cx_px], [0.0, geometry.focal_px, geometry.cy_px], [0.0, 0.0, 1.0]]
    )
    shifted = matrix.copy()
    shifted[0, 2] += geometry.doffs_px
    ideal = np.zeros(5)
    turn = view.R_rectified_left
    return (
        (CameraModel(width_px=view.width_px, height_px=view.height_px, matrix=matrix, distortion=ideal), Pose(turn)),
        (
            CameraModel(width_px=view.width_px, height_px=view.height_px, matrix=shifted, distortion=ideal),
            Pose(turn, turn.T @ [geometry.baseline_m, 0.0, 0.0]),
        ),
    )


def truth(scene: Scene, view: RectifiedView, sensors: tuple[tuple[CameraModel, Pose], ...] = ()) -> Truth:
    """Compute exact depth, disparity and visibility for the rectified left image.

    Args:
        scene: frozen at the moment of the image (`Scene.at`).
        view: the rectified left camera.
        sensors: the real cameras and their poses. If given, a point counts as visible only if it also lies inside each
            of their images (a rectified image has corners that no sensor fills).

    Returns:
        The truth at each pixel centre.
    """
    (left, left_pose), (_, right_pose) = rectified_cameras(view)
    shape = (view.height_px, view.width_px)
    rays = left_pose.R_camera_scene.T @ pixel_rays(left).reshape(3, -1)
    hits = cast(scene.bodies, left_pose.centre_m, rays)
    found = np.flatnonzero(np.isfinite(hits.depth))
    points = left_pose.centre_m[:, None] + hits.depth[found] * rays[:, found]

    depth = np.full(rays.shape[1], np.nan)
    depth[found] = hits.depth[found]
    disparity = view.geometry.focal_px * view.geometry.baseline_m / depth - view.geometry.doffs_px

    back = cast(scene.bodies, right_pose.centre_m, points - right_pose.centre_m[:, None])
    clear = back.depth > 1.0 - _SAME_POINT
    x_right = found % view.width_px - disparity[found]
    inside = (x_right >= 0.0) & (x_right <= view.width_px - 1)
    for model, pose in sensors:
        inside &= _inside(points, model, pose)
    visible, hidden = np.zeros((2, rays.shape[1]), dtype=np.bool_)
    visible[found] = clear & inside
    hidden[found] = ~clear
    return Truth(
        depth_m=depth.reshape(shape),
        disparity_px=disparity.reshape(shape),
        visible=visible.reshape(shape),
        hidden=hidden.reshape(shape),
        body=(hits.surface // FACES).reshape(shape),
    )


def _inside(points: Floats, model: CameraModel, pose: Pose) -> NDArray[np.bool_]:
    """Return whether points (3, N) fall on the sensor."""
    x, y = project(points, model, pose)
    # Far outside the image the distortion polynomial folds back into it. Such points are farther from the axis than the
    # farthest corner, so leave them out.
    local = pose.R_camera_scene @ (points - pose.centre_m[:, None])
    right, bottom = model.width_px - 1.0, model.height_px - 1.0
    corners = rays_through(model, np.array([0.0, right, 0.0, right]), np.array([0.0, 0.0, bottom, bottom]))
    edge = np.hypot(corners[0], corners[1]).max()
    near_axis = np.hypot(local[0], local[1]) <= edge * local[2]
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = (
            near_axis & (x >= 0.0) & (x <= model.width_px - 1) & (y >= 0.0) & (y <= model.height_px - 1)
        )
    return inside


DEMO_PERIOD_S = 4.0
"""The demo's scene repeats after this time, so a film of one period can be shown in a loop."""

BASELINE_M = 0.100
FOCAL_PX = 525.0


def matched_rig() -> Rig:
    """Return two ideal pinhole cameras of 640x480, f = 525 px, 100 mm apart, already rectified: for accuracy tests."""
    matrix = np.array([[FOCAL_PX, 0.0, 319.5], [0.0, FOCAL_PX, 239.5], [0.0, 0.0, 1.0]])
    model = CameraModel(width_px=640, height_px=480, matrix=matrix, distortion=np.zeros(5))
    return Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-BASELINE_M, 0.0, 0.0]))


def unlike_rig() -> Rig:
    """Return the demo's two cameras: a 640x480 webcam with barrel distortion on the left, an 800x600 phone on the right.

    The phone is turned by about 1.5 degrees and stands 100 mm to the right, slightly higher and farther back.
    """
    webcam = CameraModel(
        width_px=640,
        height_px=480,
        matrix=np.array([[525.0, 0.0, 316.8], [0.0, 526.2, 243.1], [0.0, 0.0, 1.0]]),
        distortion=np.array([-0.24, 0.085, 0.0006, -0.0004, -0.012]),
    )
    phone = CameraModel(
        width_px=800,
        height_px=600,
        matrix=np.array([[702.5, 0.0, 404.6], [0.0, 701.1, 296.2], [0.0, 0.0, 1.0]]),
        distortion=np.array([0.065, -0.14, -0.0005, 0.0007, 0.05]),
    )
    turn = rotation((0.3, 1.0, 0.45), math.radians(-1.5))
    centre = np.array([0.0998, -0.004, -0.005])
    centre *= BASELINE_M / np.linalg.norm(centre)
    return Rig(left=webcam, right=phone, R_right_left=turn, t_right_left_m=-turn @ centre)


WEBCAM_LOOK = Look(gain_bgr=(0.95, 0.97, 1.02), offset=4.0, gamma=2.0, vignetting=0.25, noise_sigma=1.2, seed=1)
PHONE_LOOK = Look(gain_bgr=(1.06, 1.04, 1.0), offset=0.0, gamma=2.0, vignetting=0.1, noise_sigma=0.8, seed=2)


def demo_scene() -> Scene:
    """Return a moving still life at 0.7 to 2.5 m: a table before a wall, a ball that rolls in a circle, boxes that turn.

    It repeats every `DEMO_PERIOD_S`.
    """
    flat = rotation((1.0, 0.0, 0.0), math.radians(-90.0))
    upright = (0.0, 1.0, 0.0)
    table_y = 0.32
    turn = 2.0 * math.pi / DEMO_PERIOD_S
    quarter = math.pi / 2.0
    roll = Path(
        amplitude_m=(0.20, 0.0, 0.14),
        phase_rad=(0.0, 0.0, quarter),
        period_s=DEMO_PERIOD_S,
        spin_axis=(0.3, 1.0, 0.2),
        spin_rad_s=turn,
    )
    hover = Path(
        amplitude_m=(0.03, 0.04, 0.06),
        phase_rad=(1.0, 0.0, 2.0),
        period_s=DEMO_PERIOD_S,
        spin_axis=(0.4, 1.0, 0.2),
        spin_rad_s=-turn,
    )
    sway = Path(
        amplitude_m=(0.05, 0.0, 0.0),
        phase_rad=(0.5, 0.0, 0.0),
        period_s=DEMO_PERIOD_S,
        spin_axis=upright,
        spin_rad_s=turn,
    )
    wall = Texture(seed=11, light_bgr=(0.58, 0.62, 0.63), dark_bgr=(0.50, 0.53, 0.51), contrast=0.36, shortest_m=0.008)
    wood = Texture(
        seed=12,
        light_bgr=(0.24, 0.42, 0.64),
        dark_bgr=(0.12, 0.24, 0.42),
        contrast=0.45,
        longest_m=0.13,
        stretch=(1.0, 2.5, 1.0),
    )
    poster = Texture(
        seed=17, light_bgr=(0.50, 0.44, 0.22), dark_bgr=(0.34, 0.26, 0.10), contrast=0.45, shortest_m=0.008
    )
    red = Texture(seed=13, light_bgr=(0.16, 0.22, 0.80), dark_bgr=(0.06, 0.08, 0.45), longest_m=0.13)
    blue = Texture(seed=14, light_bgr=(0.72, 0.46, 0.16), dark_bgr=(0.44, 0.20, 0.06), longest_m=0.13)
    green = Texture(seed=16, light_bgr=(0.28, 0.60, 0.30), dark_bgr=(0.12, 0.36, 0.12), longest_m=0.13)
    yellow = Texture(seed=15, light_bgr=(0.14, 0.62, 0.84), dark_bgr=(0.08, 0.36, 0.60), longest_m=0.13)
    violet = Texture(seed=18, light_bgr=(0.62, 0.34, 0.52), dark_bgr=(0.34, 0.14, 0.28), longest_m=0.06)
    return Scene(
        (
            Body("wall", Plane(), (0.0, 0.0, 2.5), wall),
            Body("table", Plane(), (0.0, table_y, 1.5), wood, flat),
            Body("poster", Plane(0.9, 0.62), (-0.52, -0.42, 2.30), poster, rotation(upright, -0.35)),
            Body("brick", Box((0.34, 0.12, 0.18)), (-0.60, table_y - 0.06, 1.9), yellow, rotation(upright, 0.5)),
            Body("marble", Sphere(0.05), (0.27, table_y - 0.05, 0.86), violet),
            Body("ball", Sphere(0.12), (0.02, table_y - 0.12, 1.15), red, path=roll),
            Body("cube", Box((0.19, 0.19, 0.19)), (-0.27, -0.08, 1.1), blue, path=hover),
            Body("tower", Box((0.22, 0.50, 0.22)), (0.50, table_y - 0.25, 1.65), green, path=sway),
        ),
        Light(),
    )
