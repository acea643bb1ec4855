"""Computes what a perfect stereo matcher would measure in a scene: exact depth, disparity and which camera sees what.

Everything is float64 and taken at pixel centres, directly from the shapes; no image is involved.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel
from phone_host.scene.cast import FACES, cast, pixel_rays, project, rays_through
from phone_host.scene.scene_model import Floats, Pose, RectifiedView, Scene

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
