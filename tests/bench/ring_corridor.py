"""A corridor that goes around a block of rooms, rendered for a stereo rig: walls with paper that repeats or not, and posts as door frames.

Walls, floor, ceiling and posts are rectangles. The reciprocal depth of a plane is linear in the pixel, so each rectangle is drawn into a
buffer of reciprocal depths, inside the bounds of its corners only.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image, StereoGeometry

Floats = NDArray[np.float64]

GEOMETRY: Final = StereoGeometry(focal_px=330.0, baseline_m=0.1, cx_px=199.5, cy_px=149.5)
SIZE: Final = (400, 300)
"""Width and height of the images, px."""

_TEXEL_M: Final = 0.006
_FAR_M: Final = 12.0
_NEAR_M: Final = 0.02
_GREY_NOISE: Final = 2.0
_RIGHT_GAIN: Final = 0.94
"""Brightness of the right camera beside the left one's."""

_TURN: Final = np.radians(8.0)
"""Most that the camera turns from pair to pair, in the corners."""

_DOWN: Final = np.array([0.0, 1.0, 0.0])


class Walls(Enum):
    """How the walls look: REPEATED, the same paper again and again; UNLIKE, each place has its own."""

    REPEATED = "repeated"
    UNLIKE = "unlike"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ring:
    """A ring and the way through it.

    Attributes:
        seed: of papers, posts, noise and the way's sway.
        walls: how they look.
        period_m: distance after which paper and posts repeat, m.
        size_m: outer width and depth, m.
        width_m: of the corridor, m.
        height_m: of the corridor, m.
        camera_m: height of the camera above the floor, m.
        equal_doors: whether all posts look alike; else each has its own paper and height.
        laps: how often the camera goes around.
        step_m: from pair to pair, m: the speed by the rate of the pairs.
    """

    seed: int = 1
    walls: Walls = Walls.REPEATED
    period_m: float = 3.0
    size_m: tuple[float, float] = (8.0, 6.0)
    width_m: float = 1.8
    height_m: float = 2.4
    camera_m: float = 1.2
    equal_doors: bool = True
    laps: float = 2.0
    step_m: float = 0.18


@dataclass(frozen=True, slots=True, eq=False)
class _Rectangle:
    """A rectangle: middle (3,), m, axes (3, 3): normal towards who sees it, across, along; half its sides, m; its paper."""

    middle_m: Floats
    axes: Floats
    half_m: tuple[float, float]
    paper: Image


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """What was drawn so far: reciprocal depths, 1/m, and grey levels, (H, W) float32."""

    near: NDArray[np.float32] = field(default_factory=lambda: np.full(SIZE[::-1], 1 / _FAR_M, np.float32))
    grey: NDArray[np.float32] = field(default_factory=lambda: np.zeros(SIZE[::-1], np.float32))


class RingScene:
    """Renders a ring.

    Attributes:
        poses: where the left camera is at each pair, in axes of the ring: x and z along its sides, y down.

    Args:
        ring: which.
    """

    def __init__(self, ring: Ring) -> None:
        self._ring = ring
        self._middle = np.array(ring.size_m) - ring.width_m  # sides of the way, m
        self.poses = tuple(self._way())
        self._rectangles = [*self._shell(), *self._posts()]

    @property
    def round_m(self) -> float:
        """Length of one lap, m."""
        return 2 * float(self._middle.sum())

    def pair(self, number: int) -> tuple[Image, Image]:
        """Render a pair.

        Args:
            number: of the pair, from 0.

        Returns:
            Left and right image, (H, W) uint8, rectified.
        """
        left, noise = self.poses[number], np.random.default_rng([self._ring.seed, number])
        right = left @ SE3(np.eye(3), np.array([GEOMETRY.baseline_m, 0.0, 0.0]))
        images = (self._grey(left), _RIGHT_GAIN * self._grey(right))
        shown = [np.clip(each + noise.normal(0, _GREY_NOISE, each.shape), 0, 255).astype(np.uint8) for each in images]
        return shown[0], shown[1]

    def _grey(self, pose: SE3) -> NDArray[np.float32]:
        drawn = _Drawn()
        for each in self._rectangles:
            _draw(drawn, each, pose)
        return drawn.grey

    def _paper(self, kind: int, width_m: float) -> Image:
        """Return a paper: one period of the common one, or one of its own as wide as a wall."""
        if self._ring.walls is Walls.REPEATED:
            return _blotches((self._ring.seed, 0), self._ring.period_m)
        return _blotches((self._ring.seed, kind), width_m)

    def _shell(self) -> Iterator[_Rectangle]:
        ring, (x, z) = self._ring, self._ring.size_m
        high = ring.height_m / 2
        above = high - ring.camera_m  # of the camera: the middle of the walls, downwards
        for kind, (inner, sign) in enumerate((inner, sign) for inner in (False, True) for sign in (1, -1)):
            inside = 2 * ring.width_m if inner else 0.0
            toward = -sign if not inner else sign
            for axis, length, depth in ((0, x - inside, z - inside), (2, z - inside, x - inside)):
                middle, normal = np.zeros(3), np.zeros(3)
                middle[2 - axis], normal[2 - axis], middle[1] = sign * depth / 2, toward, -above
                axes = np.array([normal, np.cross(normal, _DOWN), _DOWN])  # across: to the right of who looks at it
                yield _Rectangle(middle, axes, (length / 2, high), self._paper(10 * kind + axis + 1, length))
        flat = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        for kind, y in ((50, ring.camera_m), (51, ring.camera_m - ring.height_m)):
            axes = flat if y > 0 else flat * np.array([[-1.0], [1.0], [1.0]])
            yield _Rectangle(np.array([0.0, y, 0.0]), axes, (x / 2, z / 2), self._paper(kind, max(x, z)))

    def _posts(self) -> Iterator[_Rectangle]:
        """Posts beside the way, two for each period, left and right in turn."""
        ring, random, along, number = self._ring, np.random.default_rng([self._ring.seed, 3]), 0.8, 0
        common = _blotches((ring.seed, 1), 0.6)
        while along < self.round_m:
            (x, z), yaw = self._at(along)
            side, ahead = np.array([np.cos(yaw), 0, -np.sin(yaw)]), np.array([np.sin(yaw), 0, np.cos(yaw)])
            sign = 1 if number % 2 else -1
            high = ring.height_m * (0.42 if ring.equal_doors else 0.2 + 0.3 * random.random())
            foot = np.array([x, ring.camera_m - high / 2, z]) + side * sign * (ring.width_m / 2 - 0.12)
            papers = (common, common)
            if not ring.equal_doors:
                papers = (_blotches((ring.seed, 100 + number), 0.6), _blotches((ring.seed, 200 + number), 0.6))
            yield _Rectangle(foot, np.array([-ahead, side, _DOWN]), (0.12, high / 2), papers[0])
            inner = foot - side * sign * 0.12 + ahead * 0.12
            yield _Rectangle(inner, np.array([-side * sign, ahead, _DOWN]), (0.12, high / 2), papers[1])
            along, number = along + ring.period_m / 2, number + 1

    def _at(self, along_m: float) -> tuple[Floats, float]:
        """Return x, z and heading after a way along the middle of the corridor."""
        (x, z), left = self._middle, along_m % self.round_m
        sides = (
            ((-x / 2, -z / 2), z, 0.0),
            ((-x / 2, z / 2), x, 0.5),
            ((x / 2, z / 2), z, 1.0),
            ((x / 2, -z / 2), x, 1.5),
        )
        for start, length, quarter in sides:
            yaw = quarter * np.pi
            if left <= length:
                return np.array(start) + left * np.array([np.sin(yaw), np.cos(yaw)]), yaw
            left -= length
        return np.array(sides[0][0]), 0.0

    def _way(self) -> Iterator[SE3]:
        """Go along with some sway; turn on the spot in the corners."""
        phase, yaw, along = np.random.default_rng(self._ring.seed).uniform(0, 2 * np.pi, 3), 0.0, 0.0
        while along < self._ring.laps * self.round_m + 0.6:
            (x, z), heading = self._at(along)
            heading += 2 * np.pi * int(along // self.round_m)
            while heading - yaw > _TURN:
                yaw += _TURN
                yield _pose(x, z, yaw)
            yaw = heading
            sway = np.array([0.05, 0.05, 0.04]) * np.sin(np.array([2.0, 1.7, 3.0]) * along + phase)
            yield _pose(x + sway[0], z + sway[1], yaw + sway[2])
            along += self._ring.step_m


def _pose(x: float, z: float, yaw: float) -> SE3:
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return SE3(turn, np.array([x, 0.0, z]))


def _blotches(seed: tuple[int, int], width_m: float) -> Image:
    """Return blotches of several sizes, as wide as asked for and 2.4 m high; it continues at its borders."""
    width, height = round(width_m / _TEXEL_M), round(2.4 / _TEXEL_M)
    random, whole = np.random.default_rng(seed), np.zeros((height, width), np.float32)
    for size in (1.0, 2.5, 6.0, 15.0):
        step = max(1, int(size // 2))
        coarse = random.normal(size=(-(-height // step), -(-width // step))).astype(np.float32)
        margin = 8 * max(1, round(size / step))
        soft = cv2.GaussianBlur(np.pad(coarse, margin, mode="wrap"), (0, 0), size / step)[
            margin:-margin, margin:-margin
        ]
        whole += cv2.resize(soft / soft.std(), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.clip(128 + 30 * whole, 0, 255).astype(np.uint8)


def _draw(drawn: _Drawn, of: _Rectangle, pose: SE3) -> None:
    """Draw a rectangle before what is farther; one that is seen from behind is not there."""
    away = of.middle_m - pose.t_m
    facing = float(of.axes[0] @ away)
    if facing >= 0:
        return
    corners = np.array(
        [away + i * of.half_m[0] * of.axes[1] + j * of.half_m[1] * of.axes[2] for i in (-1, 1) for j in (-1, 1)]
    )
    bounds = _bounds(corners @ pose.R)
    if bounds is None:
        return
    rows, columns = bounds
    u = (np.arange(columns.start, columns.stop, dtype=np.float32) - GEOMETRY.cx_px) / GEOMETRY.focal_px
    v = (np.arange(rows.start, rows.stop, dtype=np.float32)[:, np.newaxis] - GEOMETRY.cy_px) / GEOMETRY.focal_px
    slopes = (of.axes @ pose.R).astype(np.float32)  # each row: an axis in the camera's axes
    normal, across, along = (row[0] * u.astype(np.float32) + row[1] * v.astype(np.float32) + row[2] for row in slopes)
    near = normal / np.float32(facing)
    seen = near > drawn.near[rows, columns]
    if not seen.any():
        return
    depth = 1 / np.maximum(near, np.float32(1e-6))
    here, there = (each * depth - np.float32(axis @ away) for each, axis in ((across, of.axes[1]), (along, of.axes[2])))
    seen &= (np.abs(here) < of.half_m[0]) & (np.abs(there) < of.half_m[1])
    texels = [
        ((each + half) / _TEXEL_M).astype(np.float32) for each, half in zip((here, there), of.half_m, strict=True)
    ]
    shown = cv2.remap(of.paper, texels[0], texels[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    drawn.near[rows, columns][seen] = near[seen]
    drawn.grey[rows, columns][seen] = np.asarray(shown)[seen]


def _bounds(corners_m: Floats) -> tuple[slice, slice] | None:
    """Return rows and columns in which corners (4, 3), in the camera's axes, span a rectangle; None: outside of the image."""
    z = corners_m[:, 2]
    if (z < _NEAR_M).all():
        return None
    if (z < _NEAR_M).any():
        return slice(0, SIZE[1]), slice(0, SIZE[0])
    at = corners_m[:, :2] / z[:, np.newaxis] * GEOMETRY.focal_px + (GEOMETRY.cx_px, GEOMETRY.cy_px)
    low, high = np.floor(at.min(axis=0)).astype(int), np.ceil(at.max(axis=0)).astype(int) + 1
    low, high = np.maximum(low, 0), np.minimum(high, SIZE)
    return (slice(low[1], high[1]), slice(low[0], high[0])) if (low < high).all() else None
