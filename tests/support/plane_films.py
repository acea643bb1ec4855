"""Views of textured planes by a camera that moves, with exact depth: one plane, the corner of a room, or a street."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.model import StereoGeometry
from phone_host.scan.view import View

Floats = NDArray[np.float64]

GEOMETRY = StereoGeometry(focal_px=200.0, baseline_m=0.1, cx_px=119.5, cy_px=89.5)
SIZE = (240, 180)

_TEXEL_M = 0.004
_TEXTURE_PX = 800


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """Where rows of `axes` are the normal, towards the camera, and two directions in it; (3, 3). `half_m`: half its sides along these, m."""

    through_m: Floats
    axes: Floats
    half_m: tuple[float, float] = (math.inf, math.inf)


def plane_at(through_m: list[float], turn: list[float]) -> Plane:
    """A plane through a point, m, that faces -z until it is turned, rad."""
    toward = np.array([[0, 0, -1.0], [1, 0, 0], [0, 1, 0]])
    return Plane(np.array(through_m), toward @ rotations_of(np.array(turn)).T)


WALL = (plane_at([0, 0, 1.0], [0.1, 0.2, 0.0]),)
"""One plane, 1 m away."""

CORNER = (
    plane_at([-0.35, 0, 1.0], [0.0, -0.8, 0.0]),
    plane_at([0.35, 0, 1.0], [0.0, 0.8, 0.0]),
    plane_at([0, 0.1, 1.0], [0.9, 0.0, 0.0]),
)
"""Three planes: every direction can be told."""


def texture(seed: int = 1) -> NDArray[np.uint8]:
    """Blotches of several sizes, (800, 800) uint8."""
    random, whole = np.random.default_rng(seed), np.zeros((_TEXTURE_PX, _TEXTURE_PX))
    for size in (2.0, 4.0, 8.0):
        noise = cv2.GaussianBlur(random.normal(size=whole.shape), (0, 0), size)
        whole += noise / noise.std()
    return np.clip(128 + 35 * whole, 0, 255).astype(np.uint8)


STREET = (
    plane_at([0, 1.6, 0.0], [np.pi / 2, 0.0, 0.0]),
    plane_at([-8.0, 0, 0.0], [0.0, -np.pi / 2, 0.0]),
    plane_at([8.0, 0, 0.0], [0.0, np.pi / 2, 0.0]),
    plane_at([0, 0, 90.0], [0.0, 0.0, 0.0]),
)
"""The road, houses on both sides, and what closes the street."""

STREET_SIZE = (640, 240)


def street_view(
    world_camera: SE3, picture: NDArray[np.uint8], baseline_m: float, disparity_noise_px: float = 0.3
) -> View:
    """A street as a car sees it, its disparities with errors that reach over 16 px."""
    geometry = StereoGeometry(focal_px=400.0, baseline_m=baseline_m, cx_px=319.5, cy_px=109.5)
    view = plane_view(world_camera, picture, STREET, 0.5, geometry=geometry, size=STREET_SIZE, texel_m=0.05)
    noise = cv2.GaussianBlur(np.random.default_rng(view.grey[::9].ravel()).normal(size=view.grey.shape), (0, 0), 8.0)
    product = geometry.focal_px * baseline_m
    disparity = product / view.depth_m + disparity_noise_px * noise / noise.std()
    return replace(view, depth_m=np.where(disparity > 1.0, product / disparity, np.nan).astype(np.float32))


def plane_view(
    world_camera: SE3,
    picture: NDArray[np.uint8],
    planes: tuple[Plane, ...] = WALL,
    noise_px: float = 0.1,
    *,
    geometry: StereoGeometry = GEOMETRY,
    size: tuple[int, int] = SIZE,
    texel_m: float = _TEXEL_M,
) -> View:
    """What a camera sees: of several planes the nearest, each with the picture on it."""
    width, height = size
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    slopes = ((columns - geometry.cx_px) / geometry.focal_px, (rows - geometry.cy_px) / geometry.focal_px)
    rays = np.stack([*slopes, np.ones(columns.shape)], axis=-1)
    depth, grey = np.full(columns.shape, np.inf), np.zeros(columns.shape, np.uint8)
    for plane in planes:
        there = (plane.axes[0] @ (plane.through_m - world_camera.t_m)) / (rays @ world_camera.R.T @ plane.axes[0])
        points = world_camera.apply(rays * there[..., np.newaxis]) - plane.through_m
        across = points @ plane.axes[1:].T
        texels = (across / texel_m + _TEXTURE_PX / 2).astype(np.float32)
        shown = np.asarray(
            cv2.remap(picture, texels[..., 0], texels[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        )
        nearer = (there > 0) & (there < depth) & (np.abs(across) <= plane.half_m).all(axis=-1)
        depth, grey = np.where(nearer, there, depth), np.where(nearer, shown, grey).astype(np.uint8)
    return View(
        grey=grey,
        colours=np.repeat(grey[..., np.newaxis], 3, axis=2),
        depth_m=depth.astype(np.float32),
        geometry=geometry,
        noise_px=noise_px,
    )


def nearest_view(views: Sequence[View]) -> View:
    """Put what one camera sees of several things into one view: each pixel shows the nearest of them."""
    depths, greys = (np.array([getattr(view, name) for view in views]) for name in ("depth_m", "grey"))
    nearest = np.argmin(depths, axis=0)[np.newaxis]
    depth, grey = (np.take_along_axis(each, nearest, axis=0)[0] for each in (depths, greys))
    return replace(views[0], depth_m=depth, grey=grey, colours=np.repeat(grey[..., np.newaxis], 3, axis=2))


def path(count: int, step: Floats) -> list[SE3]:
    """Poses that go on by the same motion, (6,) turn, rad, and shift, m."""
    poses = [SE3.identity()]
    for _ in range(count - 1):
        poses.append(poses[-1] @ SE3.of(step))
    return poses


def distance(one: SE3, other: SE3) -> Floats:
    """Turn, rad, and shift, m, between two poses."""
    difference = (one.inverse() @ other).pose()
    return np.array([np.linalg.norm(difference[:3]), np.linalg.norm(difference[3:])])
