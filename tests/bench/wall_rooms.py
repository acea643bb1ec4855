"""Rendered rooms whose back wall is bare, for bench_walls and tests: the hardest place for a matcher that must not invent depth.

Textured things and pictures stand before and hang on the wall, so that there is depth to carry on to it. Paint, cameras and
truth are those of `depth_rooms`; each room has its own size, wall, noise, JPEG quality and slant.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import StereoGeometry
from phone_host.scene.scene import rectified_cameras, truth
from phone_host.scene.scene_model import Body, Box, Plane, RectifiedView, Scene, Sphere, rotation
from tests.bench.depth_rooms import GAIN, LOWER_PX, OFFSET, Sensor
from tests.bench.depth_scenes import Image, Values
from tests.bench.room_painter import Paint, Painted, paint_view

_SIZES: Final = {640: ((640, 480), 525.0), 1280: ((1280, 720), 900.0)}
_BASELINE_M: Final = 0.1
_UP: Final = (0.0, 1.0, 0.0)
_SEARCHED: Final = 8
"""A part of the width: 0.66 m at 640 px of width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walls:
    """What is varied.

    Attributes:
        seed: of furniture and noise.
        width_px: 640 or 1280.
        wall_levels: grey levels of the wall's texture from the darkest to the brightest; 0: bare.
        noise: strength of the sensors' noise, see `depth_rooms.Sensor`; 0: none.
        quality: of the JPEGs; 0: lossless.
        slant: of the wall, rad.
        unlike: whether the right camera is darker, half a pixel too low and less sharp.
    """

    seed: int
    width_px: int = 640
    wall_levels: float = 0.0
    noise: float = 0.5
    quality: int = 0
    slant: float = 0.0
    unlike: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class WallRoom:
    """A room as two cameras see it.

    Attributes:
        left: (H, W, 3) uint8.
        right: the same.
        truth: (H, W) float32, px; NaN where only one camera sees the surface.
        wall: (H, W) bool.
        geometry: of the two cameras.
        disparities: how far to search, px.
    """

    left: Image
    right: Image
    truth: Values
    wall: NDArray[np.bool_]
    geometry: StereoGeometry
    disparities: int


def wall_room(walls: Walls) -> WallRoom:
    """Paint a room; takes a second or some."""
    random = np.random.default_rng([walls.seed, 77])
    painted = _furnished(random, walls)
    (width_px, height_px), focal_px = _SIZES[walls.width_px]
    middle = (width_px - 1) / 2, (height_px - 1) / 2
    geometry = StereoGeometry(focal_px=focal_px, baseline_m=_BASELINE_M, cx_px=middle[0], cy_px=middle[1])
    view = RectifiedView(geometry, width_px, height_px)
    (left, left_pose), (right, right_pose) = rectified_cameras(view)
    first = Sensor(read=walls.noise, shot=0.025 * walls.noise)
    second = first
    if walls.unlike:
        lower = right.matrix.copy()
        lower[1, 2] += LOWER_PX
        right, second = replace(right, matrix=lower), replace(first, blur_px=0.7, gain=GAIN, offset=OFFSET)
    exact = truth(painted.scene, view)
    return WallRoom(
        left=_photographed(paint_view(painted, left, left_pose), first, walls.quality, random),
        right=_photographed(paint_view(painted, right, right_pose), second, walls.quality, random),
        truth=np.where(exact.visible, exact.disparity_px, np.nan).astype(np.float32),
        wall=exact.body == 0,
        geometry=geometry,
        disparities=width_px // _SEARCHED,
    )


def _furnished(random: np.random.Generator, walls: Walls) -> Painted:
    depth_m, floor_m = float(random.uniform(1.6, 3.2)), float(random.uniform(0.35, 0.6))
    wall = Paint(level=float(random.uniform(120, 200)), texture_levels=walls.wall_levels, seed=1000 + walls.seed)
    floor = Paint(level=110.0, texture_levels=60.0, seed=2000 + walls.seed)
    turn = rotation(_UP, walls.slant)
    flat = rotation((1.0, 0.0, 0.0), -math.pi / 2)
    parts = [
        (Body("wall", Plane(), (0.0, 0.0, depth_m), R_scene_body=turn), wall),
        (Body("floor", Plane(), (0.0, floor_m, depth_m / 2), R_scene_body=flat), floor),
    ]
    for number in range(int(random.integers(2, 5))):
        z = float(random.uniform(0.9, depth_m - 0.4))
        size = float(random.uniform(0.08, 0.2)) * z
        wide, high = (size * float(factor) for factor in random.uniform(0.6, 1.8, 2))
        shape = Sphere(size / 1.5) if random.uniform() < 0.4 else Box((wide, high, size))
        place = (float(random.uniform(-0.5, 0.5)) * z, floor_m - size / 2, z)
        paint = Paint(level=float(random.uniform(60, 200)), texture_levels=70.0, seed=3000 + 10 * walls.seed + number)
        body = Body(f"thing{number}", shape, place, R_scene_body=rotation(_UP, float(random.uniform(0, 3))))
        parts.append((body, paint))
    for number in range(int(random.integers(0, 3))):
        x = float(random.uniform(-0.4, 0.4)) * depth_m
        # The wall's plane at that x, a hand's breadth nearer.
        place = (x, float(random.uniform(-0.3, 0.0)) * depth_m, depth_m - x * math.tan(walls.slant) - 0.05)
        paint = Paint(level=120.0, texture_levels=70.0, seed=4000 + 10 * walls.seed + number)
        parts.append((Body(f"picture{number}", Box((0.25, 0.2, 0.03)), place, R_scene_body=turn), paint))
    return Painted(Scene(tuple(body for body, _ in parts)), tuple(paint for _, paint in parts))


def _photographed(levels: NDArray[np.float32], sensor: Sensor, quality: int, random: np.random.Generator) -> Image:
    blur_px = sensor.blur_px * levels.shape[1] / 640
    seen = np.clip(cv2.GaussianBlur(levels, (0, 0), blur_px), 0, 255)
    noise = np.sqrt(sensor.read**2 + sensor.shot * seen) * random.standard_normal(seen.shape)
    levels = np.clip(np.rint(sensor.gain * (seen + noise) + sensor.offset), 0, 255)
    image = np.asarray(levels, np.uint8)
    if not quality:
        return image
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
