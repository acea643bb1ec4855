"""Rendered rooms for tuning and judging matchers: hardly textured walls, a glossy box, thin poles, slanted floors, tiles and bars.

Real rooms look like this and the usual benchmarks do not. Each room is seen by two unlike webcams: shot and read noise,
slight blur, JPEG of quality 80, the right image darker (0.7 of the levels, plus 20) and half a pixel too low. The truth
is exact, computed from the shapes. Equal seeds make equal rooms; the images are kept in build/rooms, because painting
one takes seconds.
"""

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import StereoGeometry
from phone_host.scene.cast import pixel_rays, to_body
from phone_host.scene.scene import rectified_cameras, truth
from phone_host.scene.scene_model import Body, Box, Plane, RectifiedView, Rotation, Scene, Sphere, Vector, rotation
from tests.bench import room_painter
from tests.bench.depth_scenes import Image, Values
from tests.bench.room_painter import Paint, Painted, Pattern, paint_view

KEPT_IN: Final = Path(__file__).resolve().parents[2] / "build" / "rooms"
SEEDS: Final = tuple(range(1, 9))
WIDE_SEEDS: Final = (21, 22)
"""Rooms of 640x480, and of 1280x720."""

LOWER_PX: Final = 0.5
GAIN, OFFSET = 0.7, 20.0
QUALITY: Final = 80
BLURS_PX: Final = (0.5, 0.7)
"""Standard deviation of each lens's blur: a webcam in focus, a cheaper one nearly so."""

PARTS: Final = ("nothing", "wall", "plain", "side", "floor", "pole", "bar", "glossy", "ball", "screen", "blind")
"""What rooms are made of; `plain` is the part of the wall without texture, `bar` one of the fence's."""

_BASELINE_M: Final = 0.1
_UP: Final = (0.0, 1.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """One webcam. Noise, in grey levels: sigma^2 = read^2 + shot * level.

    Read 1.0 and shot 0.025 give a sigma of 2.0 at level 128: a cheap webcam in a lit room, before its JPEG. The rooms
    take a half, one, and one and a half of both.

    Attributes:
        read: sigma in the dark, grey levels.
        shot: growth of the variance with the level.
        blur_px: standard deviation of the lens's blur at 640 px of width, px.
        gain: of the levels.
        offset: added to them.
    """

    read: float = 1.0
    shot: float = 0.025
    blur_px: float = 0.5
    gain: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """A room as two webcams see it.

    Attributes:
        name: with its seed.
        left: (H, W, 3).
        right: the same.
        truth: (H, W), disparity, px; NaN where only one camera sees the surface.
        parts: (H, W) uint8, what each pixel shows: index in PARTS.
        disparities: how far to search, px.
    """

    name: str
    left: Image
    right: Image
    truth: Values
    parts: NDArray[np.uint8]
    disparities: int


def view_of(width_px: int) -> RectifiedView:
    """The rectified left camera: 640x480 of a webcam, or 1280x720 of a wider one."""
    size, focal_px = ((640, 480), 525.0) if width_px == 640 else ((1280, 720), 900.0)
    cx_px, cy_px = (size[0] - 1) / 2, (size[1] - 1) / 2
    return RectifiedView(StereoGeometry(focal_px=focal_px, baseline_m=_BASELINE_M, cx_px=cx_px, cy_px=cy_px), *size)


def rooms(seeds: Sequence[int] = SEEDS, wide_seeds: Sequence[int] = WIDE_SEEDS) -> Iterator[Room]:
    """Give the rooms, painting those that are not kept yet."""
    for width_px, numbers in ((640, seeds), (1280, wide_seeds)):
        for seed in numbers:
            yield room(seed, width_px)


def room(seed: int, width_px: int = 640) -> Room:
    """Give one room, from build/rooms if it is there."""
    path = KEPT_IN / f"{_version()}-{width_px}-{seed}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        made = _paint(seed, width_px)
        part = path.with_suffix(".part.npz")
        np.savez(part, left=made.left, right=made.right, truth=made.truth, parts=made.parts)
        part.rename(path)
    with np.load(path) as kept:
        images = kept["left"], kept["right"]
        return Room(f"room{seed}-{width_px}", *images, kept["truth"], kept["parts"], width_px // 10)


def _version() -> str:
    """Changes with the code that paints, so that old rooms are never taken for new ones."""
    sources = (Path(__file__), Path(room_painter.__file__))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:10]


def _paint(seed: int, width_px: int) -> Room:
    random = np.random.default_rng([seed, 41])
    painted, view = furnished(random, seed), view_of(width_px)
    (left, left_pose), (right, right_pose) = rectified_cameras(view)
    lower = right.matrix.copy()
    lower[1, 2] += LOWER_PX
    strength = float(random.choice([0.5, 1.0, 1.5]))
    first = Sensor(read=strength, shot=0.025 * strength, blur_px=BLURS_PX[0])
    second = replace(first, blur_px=BLURS_PX[1], gain=GAIN, offset=OFFSET)
    images = (
        _photographed(paint_view(painted, left, left_pose), first, random),
        _photographed(paint_view(painted, replace(right, matrix=lower), right_pose), second, random),
    )
    exact = truth(painted.scene, view)
    known = np.where(exact.visible, exact.disparity_px, np.nan).astype(np.float32)
    parts = parts_of(painted, exact.body, exact.depth_m, pixel_rays(left))
    return Room(f"room{seed}-{width_px}", *images, known, parts, width_px // 10)


def parts_of(
    painted: Painted, owner: NDArray[np.int16], depth_m: NDArray[np.float64], rays: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Name what each pixel of the left image shows."""
    numbers = [PARTS.index(body.name.rstrip("0123456789")) for body in painted.scene.bodies]
    parts = np.array([*numbers, 0], np.uint8)[owner]  # owner -1: nothing
    for index, (body, paint) in enumerate(zip(painted.scene.bodies, painted.paints, strict=True)):
        if np.isfinite(paint.plain_beyond_m):
            mine = owner == index
            bare = to_body(body, depth_m[mine] * rays[:, mine])[0] > paint.plain_beyond_m
            parts[mine] = np.where(bare, PARTS.index("plain"), parts[mine])
    return parts


def _photographed(levels: NDArray[np.float32], sensor: Sensor, random: np.random.Generator) -> Image:
    """What the host gets of a view: blurred, dimmed, with noise, through JPEG."""
    size = levels.shape[1::-1]
    seen = np.clip(cv2.GaussianBlur(levels, (0, 0), sensor.blur_px * size[0] / 640), 0, 255)
    # Light that does not arrive carries less noise, but the sensor's gain raises what it reads.
    sigma = np.sqrt(sensor.read**2 + sensor.shot * seen)
    noisy = sensor.gain * (seen + sigma * random.standard_normal(seen.shape)) + sensor.offset
    image = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def furnished(random: np.random.Generator, seed: int) -> Painted:
    """Furnish a room: walls, floor and everything that stands in it."""
    depth_m, floor_m = float(random.uniform(2.0, 3.6)), float(random.uniform(0.35, 0.6))
    parts = [*_shell(random, seed, depth_m, floor_m)]
    parts += _poles(random, seed, floor_m)
    parts += _furniture(random, seed, depth_m, floor_m)
    return Painted(Scene(tuple(body for body, _ in parts)), tuple(paint for _, paint in parts))


Part = tuple[Body, Paint]


def _levels(random: np.random.Generator) -> float:
    return float(random.choice([2, 3, 4, 6, 8]))


def _tint(random: np.random.Generator) -> tuple[float, float, float]:
    b, g, r = random.uniform(0.8, 1.1, 3).tolist()
    return b, g, r


def _shell(random: np.random.Generator, seed: int, depth_m: float, floor_m: float) -> Iterator[Part]:
    """The back wall, plain beyond a line, a side wall, and a floor that is tiled in every second room."""
    wall = Paint(
        level=float(random.uniform(110, 200)),
        tint_bgr=_tint(random),
        texture_levels=_levels(random),
        plain_beyond_m=float(random.uniform(-0.2, 0.9)),
        seed=100 * seed,
    )
    yield Body("wall", Plane(), (0.0, 0.0, depth_m), R_scene_body=rotation(_UP, float(random.uniform(-0.5, 0.5)))), wall
    side = float(random.choice([-1.0, 1.0]))
    beside = Paint(level=wall.level * 0.8, tint_bgr=wall.tint_bgr, texture_levels=_levels(random), seed=100 * seed + 1)
    place = (side * float(random.uniform(1.0, 1.5)), 0.0, depth_m)
    yield Body("side", Plane(), place, R_scene_body=rotation(_UP, math.pi / 2)), beside
    tiled = seed % 2 == 0
    floor = Paint(
        level=float(random.uniform(80, 160)),
        tint_bgr=_tint(random),
        texture_levels=_levels(random),
        pattern=Pattern.TILES if tiled else Pattern.NONE,
        period_m=float(random.uniform(0.08, 0.16)),
        pattern_levels=float(random.uniform(12, 35)),
        seed=100 * seed + 2,
    )
    slant = -math.pi / 2 + float(random.uniform(-0.15, 0.15))
    yield Body("floor", Plane(), (0.0, floor_m, depth_m / 2), R_scene_body=rotation((1, 0, 0), slant)), floor


def _poles(random: np.random.Generator, seed: int, floor_m: float) -> Iterator[Part]:
    """Thin poles at several depths, 1 to 6 px wide, and in every third room a fence of equal bars."""
    for number in range(3):
        thick_m, height_m = float(random.uniform(0.004, 0.014)), float(random.uniform(0.6, 1.4))
        place = (float(random.uniform(-0.6, 0.6)), floor_m - height_m / 2, float(random.uniform(1.0, 2.0)))
        turn = rotation((0.0, 0.0, 1.0), float(random.uniform(-0.3, 0.3)))
        paint = Paint(level=float(random.choice([40, 90, 220])), texture_levels=3.0, seed=100 * seed + 10 + number)
        yield Body(f"pole{number}", Box((thick_m, height_m, thick_m)), place, R_scene_body=turn), paint
    if seed % 3 == 0:
        spacing_m, depth_m = float(random.uniform(0.05, 0.08)), float(random.uniform(1.3, 1.8))
        for number in range(9):
            place = (-0.75 + number * spacing_m, floor_m - 0.3, depth_m)
            yield Body(f"bar{number}", Box((0.02, 0.6, 0.02)), place), Paint(level=200.0, texture_levels=2.0, seed=seed)


def _furniture(random: np.random.Generator, seed: int, depth_m: float, floor_m: float) -> Iterator[Part]:
    """A glossy box, a ball, a black screen, and a blind of equal bars on the wall of rooms without a fence."""
    size = tuple(random.uniform(0.2, 0.45, 3).tolist())
    place = (float(random.uniform(-0.25, 0.35)), floor_m - size[1] / 2, float(random.uniform(1.15, 1.7)))
    turn = rotation(_UP, float(random.uniform(-0.7, 0.7)))
    gloss = Paint(
        level=float(random.uniform(50, 130)),
        tint_bgr=_tint(random),
        texture_levels=_levels(random),
        gloss_levels=float(random.uniform(80, 160)),
        gloss_exponent=float(random.uniform(250, 1500)),
        gloss_towards=_mirrored_by(turn, place, random),
        seed=100 * seed + 20,
    )
    yield Body("glossy", Box(size), place, R_scene_body=turn), gloss
    radius_m = float(random.uniform(0.08, 0.16))
    place = (float(random.uniform(-0.6, 0.6)), floor_m - radius_m, float(random.uniform(1.0, 2.0)))
    ball = Paint(level=150.0, tint_bgr=_tint(random), texture_levels=8.0, gloss_levels=60.0, seed=100 * seed + 21)
    yield Body("ball", Sphere(radius_m), place), ball
    place = (float(random.uniform(-0.9, 0.0)), float(random.uniform(-0.5, -0.1)), depth_m - 0.5)
    screen = Paint(level=22.0, texture_levels=1.0, gloss_levels=25.0, gloss_exponent=8.0, seed=100 * seed + 22)
    turn = rotation(_UP, float(random.uniform(-0.3, 0.3)))
    yield Body("screen", Plane(0.55, 0.33), place, R_scene_body=turn), screen
    if seed % 3:
        blind = Paint(
            level=170.0,
            texture_levels=2.0,
            pattern=Pattern.BARS,
            period_m=float(random.uniform(0.04, 0.09)),
            pattern_levels=float(random.uniform(15, 60)),
            seed=100 * seed + 23,
        )
        place = (float(random.uniform(0.2, 0.9)), -0.35, depth_m - 0.45)
        yield Body("blind", Plane(0.7, 0.55), place), blind


def _mirrored_by(turn: Rotation, place: Vector, random: np.random.Generator) -> Vector:
    """Direction to a window that the front of a box mirrors to the left camera, somewhere near the middle of that front."""
    to_eye = -np.asarray(place) / np.linalg.norm(place)
    normal = turn @ np.array([0.0, 0.0, -1.0])
    x, y, z = (2 * (normal @ to_eye) * normal - to_eye + random.uniform(-0.06, 0.06, 3)).tolist()
    return x, y, z
