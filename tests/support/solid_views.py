"""Views of a box with a ball on it, on a floor at z = 0, with exact depths; and how far points lie off the thing. Metres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.view import View

Floats = NDArray[np.float64]

GEOMETRY = StereoGeometry(focal_px=300.0, baseline_m=0.06, cx_px=159.5, cy_px=119.5)
SIZE = (320, 240)


@dataclass(frozen=True, slots=True)
class Thing:
    """A box that stands on the floor with its middle at the origin, and a ball.

    Attributes:
        half_m: half of the box along x and y, and its height.
        ball_m: middle of the ball.
        radius_m: of the ball.
    """

    half_m: tuple[float, float, float] = (0.05, 0.04, 0.06)
    ball_m: tuple[float, float, float] = (0.01, 0.0, 0.075)
    radius_m: float = 0.035

    def distance_m(self, points: Floats) -> Floats:
        """Return how far points (N, 3) lie off its surface, m; below 0 inside."""
        x, y, height = self.half_m
        beside = np.abs(points - [0, 0, height / 2]) - [x, y, height / 2]
        box = np.linalg.norm(np.maximum(beside, 0), axis=1) + np.minimum(beside.max(axis=1), 0)
        ball = np.linalg.norm(points - self.ball_m, axis=1) - self.radius_m
        return np.asarray(np.minimum(box, ball), np.float64)

    def volume_m3(self, step_m: float = 0.0005) -> float:
        """Return its content, counted in cells."""
        x, y, height = self.half_m
        top = max(height, self.ball_m[2] + self.radius_m)
        wide = max(x, y, self.radius_m + abs(self.ball_m[0]) + abs(self.ball_m[1]))
        side, up = np.arange(-wide + step_m / 2, wide, step_m), np.arange(step_m / 2, top, step_m)
        across, along = np.meshgrid(side, side)
        inside = 0
        for z in up:
            at = np.column_stack([across.ravel(), along.ravel(), np.full(across.size, z)])
            inside += int((self.distance_m(at) < 0).sum())
        return inside * step_m**3


def around(count: int, distance_m: float = 0.4, height_deg: float = 35.0, turn_deg: float = 360.0) -> list[SE3]:
    """Poses of a camera that looks at the thing from all sides."""
    poses = []
    for turn in np.radians(np.arange(count) * turn_deg / count):
        up = np.radians(height_deg)
        away = np.array([np.cos(turn) * np.cos(up), np.sin(turn) * np.cos(up), np.sin(up)])
        right = np.array([-np.sin(turn), np.cos(turn), 0.0])
        down = np.cross(-away, right)
        poses.append(SE3(np.column_stack([right, down, -away]), away * distance_m + [0, 0, 0.04]))
    return poses


def thing_view(thing: Thing, pose: SE3, noise_px: float = 0.1, floor_m: float = 0.5, seed: int | None = None) -> View:
    """What a camera sees of the thing and of the floor, which ends so far from the middle; beyond it there is no depth.

    Args:
        thing: it.
        pose: of the camera.
        noise_px: what the view says of its noise.
        floor_m: half of the floor's side; 0: there is none.
        seed: of the noise that is added; None: the depths are exact.
    """
    width, height = SIZE
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    slopes = ((columns - GEOMETRY.cx_px) / GEOMETRY.focal_px, (rows - GEOMETRY.cy_px) / GEOMETRY.focal_px)
    rays = np.stack([*slopes, np.ones(columns.shape)], axis=-1).reshape(-1, 3) @ pose.R.T
    depth, colours = np.full(len(rays), np.nan), np.zeros((len(rays), 3), np.uint8)
    with np.errstate(divide="ignore", invalid="ignore"):
        floor = -pose.t_m[2] / rays[:, 2]
        on = pose.t_m + floor[:, np.newaxis] * rays
        seen = (floor > 0) & (np.abs(on[:, :2]).max(axis=1) < floor_m)
        for hit, colour in ((np.where(seen, floor, np.nan), (200, 200, 200)), (_box(thing, pose, rays), (40, 160, 60)), (_ball(thing, pose, rays), (50, 60, 200))):  # fmt: skip
            nearer = (hit > 0) & ~(depth <= hit)
            depth[nearer], colours[nearer] = hit[nearer], colour
    if seed is not None:
        spread = noise_px / (GEOMETRY.focal_px * GEOMETRY.baseline_m) * depth**2
        depth = depth + np.random.default_rng(seed).normal(size=depth.shape) * spread
    image = colours.reshape(height, width, 3)
    return View(
        grey=np.ascontiguousarray(image[..., 1]),
        colours=image,
        depth_m=depth.reshape(height, width).astype(np.float32),
        geometry=GEOMETRY,
        noise_px=noise_px,
    )


def _box(thing: Thing, pose: SE3, rays: Floats) -> Floats:
    x, y, height = thing.half_m
    one, other = ((np.array(side) - pose.t_m) / rays for side in ([-x, -y, 0.0], [x, y, height]))
    enters, leaves = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
    return np.where((enters <= leaves) & (enters > 0), enters, np.nan)


def _ball(thing: Thing, pose: SE3, rays: Floats) -> Floats:
    away = pose.t_m - thing.ball_m
    a, b, c = (rays * rays).sum(axis=1), rays @ away, float(away @ away) - thing.radius_m**2
    return np.asarray((-b - np.sqrt(b * b - a * c)) / a, np.float64)
