"""A speckled thing that turns before a rig that stands still, on a table that does not turn; and how far points lie off its surface."""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.ledger import StageTimes
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import Image, Processed, RectifiedPair, StereoGeometry
from phone_host.scan.view import View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.scene.scene import PHONE_LOOK, WEBCAM_LOOK, rectified_cameras, truth
from phone_host.scene.scene_model import Body, Box, Look, Plane, RectifiedView, Scene, Sphere, Texture
from phone_host.scene.scene_render import render
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName

Floats = NDArray[np.float64]

_ELEVATION: Final = math.radians(32)
UP: Final = np.array([0.0, -math.cos(_ELEVATION), -math.sin(_ELEVATION)])
"""The table's normal in the camera's axes, and the axis about which the thing turns."""

FOOT_M: Final = np.array([0.004, 0.02, 0.43])
"""Where the axis meets the table."""

_ACROSS: Final = np.array([1.0, 0.0, 0.0])
AXES: Final = np.column_stack([_ACROSS, np.cross(UP, _ACROSS), UP])
"""(3, 3) takes the thing's axes, z up, to the camera's at the beginning."""

_SPECKLES: Final = Texture(
    seed=3, light_bgr=(0.75, 0.8, 0.85), dark_bgr=(0.1, 0.15, 0.3), contrast=0.9, shortest_m=0.003, longest_m=0.024
)
_BLUE: Final = Texture(
    seed=4, light_bgr=(0.9, 0.7, 0.4), dark_bgr=(0.3, 0.15, 0.05), contrast=0.9, shortest_m=0.003, longest_m=0.024
)
_RED: Final = Texture(
    seed=5, light_bgr=(0.4, 0.5, 0.9), dark_bgr=(0.05, 0.08, 0.35), contrast=0.9, shortest_m=0.003, longest_m=0.024
)
_WOOD: Final = Texture(seed=12, light_bgr=(0.24, 0.42, 0.64), dark_bgr=(0.12, 0.24, 0.42), longest_m=0.13)
_WALL: Final = Texture(seed=11, light_bgr=(0.58, 0.62, 0.63), dark_bgr=(0.50, 0.53, 0.51), shortest_m=0.008)

_BLOCK_M, _BLOCK_AT = np.array([0.074, 0.05, 0.046]), np.array([0.004, 0.0, 0.0235])
_POST_M, _POST_AT = np.array([0.02, 0.022, 0.078]), np.array([-0.022, 0.018, 0.0395])
_BALL_M, _BALL_AT = 0.023, np.array([0.016, -0.004, 0.062])


def off_thing_m(points_m: Floats) -> Floats:
    """Return how far points (N, 3), m, in the camera's axes at the beginning, lie off the thing's surface, (N,) m, negative inside."""
    own = (points_m - FOOT_M) @ AXES
    off = [np.linalg.norm(own - _BALL_AT, axis=1) - _BALL_M]
    for size, at in ((_BLOCK_M, _BLOCK_AT), (_POST_M, _POST_AT)):
        beside = np.abs(own - at) - size / 2
        off.append(np.linalg.norm(np.maximum(beside, 0), axis=1) + np.minimum(beside.max(axis=1), 0))
    return np.asarray(np.min(off, axis=0), np.float64)


def world_camera(angle_rad: float) -> SE3:
    """Return where the rig was at a view, in the axes of the first: the thing stands still and the rig goes around it."""
    turn = rotations_of(-angle_rad * UP)
    return SE3(turn, FOOT_M - turn @ FOOT_M)


OVER: Final = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, _BALL_AT[2] + _BALL_M + 0.0005]))
"""Takes the thing's own axes to those in which it stands when it was turned over, onto its ball."""


def turned_scene(
    angle_rad: float, *, table_turns: bool = False, shift_m: Floats | None = None, is_over: bool = False
) -> Scene:
    """Return the thing turned by an angle, on its table before a wall.

    Args:
        angle_rad: right-handed about `UP`.
        table_turns: whether table and wall turn with it.
        shift_m: (3,) by which the thing is moved; None: it isn't.
        is_over: whether it was turned over.
    """
    turn = rotations_of(angle_rad * UP)
    foot = FOOT_M if shift_m is None else FOOT_M + shift_m
    stands = OVER if is_over else SE3.identity()
    own, foot = turn @ AXES @ stands.R, foot + turn @ AXES @ stands.t_m

    def at(place: Floats) -> tuple[float, float, float]:
        x, y, z = (foot + own @ place).tolist()
        return x, y, z

    still = AXES if not table_turns else turn @ AXES
    table, wall = FOOT_M, FOOT_M + still @ np.array([0.0, 0.5, 0.0])
    facing = still @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return Scene(
        (
            Body("table", Plane(), (table[0], table[1], table[2]), _WOOD, still),
            Body("wall", Plane(), (wall[0], wall[1], wall[2]), _WALL, facing),
            Body("block", Box(tuple(_BLOCK_M.tolist())), at(_BLOCK_AT), _SPECKLES, own),
            Body("post", Box(tuple(_POST_M.tolist())), at(_POST_AT), _BLUE, own),
            Body("ball", Sphere(_BALL_M), at(_BALL_AT), _RED, own),
        )
    )


@dataclass(frozen=True, slots=True)
class Size:
    """A rectified camera: width and height, px, focal length, px, baseline, m."""

    width_px: int = 640
    height_px: int = 480
    focal_px: float = 600.0
    baseline_m: float = 0.06

    @property
    def view(self) -> RectifiedView:
        """As the renderer takes it."""
        geometry = StereoGeometry(
            focal_px=self.focal_px,
            baseline_m=self.baseline_m,
            cx_px=(self.width_px - 1) / 2,
            cy_px=(self.height_px - 1) / 2,
        )
        return RectifiedView(geometry, self.width_px, self.height_px)


def photographed(scene: Scene, size: Size, seed: int) -> RectifiedPair:
    """Render a pair with the noise of two unlike cameras, through JPEG."""
    sides = zip(rectified_cameras(size.view), (WEBCAM_LOOK, PHONE_LOOK), strict=True)
    left, right = (_through_jpeg(render(scene, *camera, _seeded(look, seed))) for camera, look in sides)
    return RectifiedPair(left, right)


def matched_view(pair: RectifiedPair, size: Size, disparities: int) -> View:
    """Match a pair with `tandem`."""
    left, right = (np.asarray(cv2.cvtColor(each, cv2.COLOR_BGR2GRAY), np.uint8) for each in (pair.left, pair.right))
    grey = RectifiedPair(left, right)
    disparity = create_matcher(MatchSettings(MatcherName.TANDEM, disparities)).match(grey)
    product = np.float32(size.focal_px * size.baseline_m)
    depth = product / np.where(disparity > 0, disparity, np.float32(np.nan))
    return View(
        grey=grey.left, colours=pair.left, depth_m=depth.astype(np.float32), geometry=size.view.geometry, noise_px=0.5
    )


def exact_view(scene: Scene, size: Size, seed: int = 0) -> View:
    """Render the left image, and give the exact depth with it."""
    camera = rectified_cameras(size.view)[0]
    colours = _through_jpeg(render(scene, *camera, _seeded(WEBCAM_LOOK, seed)))
    depth = truth(scene, size.view).depth_m.astype(np.float32)
    grey = np.asarray(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY), np.uint8)
    return View(grey=grey, colours=colours, depth_m=depth, geometry=size.view.geometry, noise_px=0.25, patch_px=5)


def _seeded(look: Look, seed: int) -> Look:
    return replace(look, seed=10 * seed + look.seed, vignetting=0.0)


def _through_jpeg(image: Image) -> Image:
    ok, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 92])
    assert ok
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)


def processed_of(view: View) -> Processed:
    """A view as the stereo core gives it."""
    cloud = np.full((*view.depth_m.shape, 3), np.nan, np.float32)
    cloud[..., 2] = view.depth_m
    of = view.geometry
    disparity = np.float32(of.focal_px * of.baseline_m) / view.depth_m
    return Processed(RectifiedPair(view.colours, view.colours), disparity, cloud, StageTimes(), geometry=of)


def over_m(points_m: Floats) -> Floats:
    """Take points (N, 3), m, of the thing in the camera's axes as it stood at first to where they are when it was turned over."""
    return np.asarray(FOOT_M + OVER.apply((points_m - FOOT_M) @ AXES) @ AXES.T, np.float64)


def exact_volume(size: Size, voxel_m: float, *, is_over: bool, views: int = 12, threads: int = 1) -> Volume:
    """The thing alone, fused from exact depths and poses all around; in the camera's axes at the beginning."""
    volume = Volume(VolumeSettings(voxel_m=voxel_m, far_m=1.0), threads)
    for number in range(views):
        angle = 2 * math.pi * number / views
        view, scene = exact_view(turned_scene(angle, is_over=is_over), size), turned_scene(angle, is_over=is_over)
        thing = truth(scene, size.view).body >= len(scene.bodies) - 3
        volume.fuse(replace(view, depth_m=np.where(thing, view.depth_m, np.float32(np.nan))), world_camera(angle))
    return volume
