"""Rendered films of a still scene, filmed by hand with a rolling shutter, as a phone gives them with and without stabilisation.

The sensor's images are larger than the film's: a stabiliser crops a part of them that it shifts, turns or warps so that the
film is smoother than the hand; without it, the same part in the middle is cropped. So the same intrinsics hold for both films.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

Image = NDArray[np.uint8]
Floats = NDArray[np.float64]

_TEXTURE_PX: Final = 1024
_STEP_S: Final = 1 / 240


class Stabiliser(Enum):
    """How the film is made smoother.

    OFF: not at all. SHIFT: the crop is shifted by what a turn does in the middle of the image. SIMILARITY: and rolled. TURN: warped by
    the homography of a turn, as if there were no distortion. ROWS: the same, each row by its own time, so the rolling shutter is
    made up for. DRIFTING_ZOOM: shifted, and zoomed so that the shift never shows the edge.
    """

    OFF = "off"
    SHIFT = "shift"
    SIMILARITY = "similarity"
    TURN = "turn"
    ROWS = "rows"
    ZOOM = "zoom"


class Place(Enum):
    """What is filmed."""

    ROOM = "room"
    DESK = "desk"
    POSTER = "poster"
    SHELF = "shelf"
    FAR = "far"
    PLAIN = "plain"


@dataclass(frozen=True, slots=True, kw_only=True)
class Take:
    """One film.

    Attributes:
        place: what is filmed.
        seed: of scene and motion.
        width_px: of the film, px.
        height_px: of the film, px.
        view_deg: horizontal angle of view of the film.
        k1: distortion of the sensor's lens.
        readout: of the rolling shutter, frame periods.
        fps: frames per second.
        seconds: length.
        sway_deg: how far the phone is turned to and fro.
        sway_hz: how often.
        tremor_deg: how much the hand trembles.
        slide_m: how far the phone is moved to and fro.
        stabiliser: what it does.
        strength: share of its correction that is applied.
        smooth_s: over how long it smooths.
        noise: standard deviation of the sensor's noise, grey levels.
        jpeg: quality.
        walker: somebody walks through the picture.
        exposure: by this share automatic exposure swings.
    """

    place: Place = Place.ROOM
    seed: int = 0
    width_px: int = 640
    height_px: int = 480
    view_deg: float = 62.0
    k1: float = -0.06
    readout: float = 0.6
    fps: int = 30
    seconds: float = 3.0
    sway_deg: float = 4.0
    sway_hz: float = 0.7
    tremor_deg: float = 0.2
    slide_m: float = 0.03
    stabiliser: Stabiliser = Stabiliser.OFF
    strength: float = 1.0
    smooth_s: float = 0.35
    noise: float = 2.0
    jpeg: int = 90
    walker: bool = False
    exposure: float = 0.0


CROP: Final = 0.9
"""Share of the sensor's image that the film shows, as stabilisers take it."""


def lens_of(take: Take) -> CameraModel:
    """Return the film's intrinsics, as a calibration at rest would give them."""
    focal = take.width_px / 2 / math.tan(math.radians(take.view_deg) / 2)
    random = np.random.default_rng([take.seed, 1])
    middle = np.array([take.width_px, take.height_px]) / 2 - 0.5 + random.uniform(-6, 6, 2)
    matrix = np.array([[focal, 0, middle[0]], [0, focal * random.uniform(0.998, 1.002), middle[1]], [0, 0, 1]])
    distortion = np.array([take.k1, -0.2 * take.k1, 0.0005, -0.0004, 0.0])
    return CameraModel(width_px=take.width_px, height_px=take.height_px, matrix=matrix, distortion=distortion)


def _sensor(take: Take) -> CameraModel:
    """Return the whole sensor's camera; the film shows the middle of its image."""
    model = lens_of(take)
    size = np.array([2 * round(length / CROP / 2) for length in (take.width_px, take.height_px)])
    matrix = model.matrix.copy()
    matrix[:2, 2] += (size - np.array([take.width_px, take.height_px])) / 2
    return replace(model, width_px=int(size[0]), height_px=int(size[1]), matrix=matrix)


class Hand:
    """How the phone moves: rotation vectors and places, (N, 6), at any moments."""

    def __init__(self, take: Take) -> None:
        random = np.random.default_rng([take.seed, 2])
        hz = [*(take.sway_hz * random.uniform(0.7, 1.4, 6)), *random.uniform(1.5, 8.0, 24)]
        self._hz, self._phase = np.array(hz), random.uniform(0, math.tau, 30)
        sway = np.radians(take.sway_deg) * np.array([0.8, 1.0, 0.3]) * random.uniform(0.8, 1.2, 3)
        slide = take.slide_m * np.array([1.0, 0.7, 0.5]) * random.uniform(0.5, 1.2, 3)
        tremble = np.repeat([np.radians(take.tremor_deg), 0.04 * take.slide_m], 3) * 1.5
        fast = np.tile(tremble, 4) / self._hz[6:]
        self._size = np.concatenate([sway, slide, fast])

    def at(self, t_s: Floats) -> Floats:
        """Return the motion at moments (N,)."""
        waves = self._size * np.sin(math.tau * self._hz * np.asarray(t_s)[:, np.newaxis] + self._phase)
        return np.asarray(waves.reshape(-1, 5, 6).sum(axis=1), np.float64)


class _Smooth:
    """The path that a stabiliser wants: the hand's turns, smoothed, but no farther away than the crop leaves room for."""

    def __init__(self, take: Take, hand: Hand) -> None:
        self._t_s = np.arange(-2.0, take.seconds + 2.0, _STEP_S)
        turns = hand.at(self._t_s)[:, :3]
        reach = np.arange(-round(3 * take.smooth_s / _STEP_S), round(3 * take.smooth_s / _STEP_S) + 1) * _STEP_S
        kernel = np.exp(-((reach / take.smooth_s) ** 2) / 2)
        kernel /= kernel.sum()
        wanted = np.stack([np.convolve(turns[:, axis], kernel, "same") for axis in range(3)], axis=1)
        room = 0.8 * (1 - CROP) / 2 * math.radians(take.view_deg) / CROP
        self._path = turns + take.strength * np.clip(wanted - turns, -room, room)

    def at(self, t_s: Floats) -> Floats:
        """Return its turns (N, 3) at moments (N,)."""
        return np.stack([np.interp(t_s, self._t_s, self._path[:, axis]) for axis in range(3)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Board:
    """A textured rectangle: middle, its two half sides (vectors), texture, and how it swings (m)."""

    middle: Floats
    across: Floats
    down: Floats
    texture: NDArray[np.float32]
    swing: float = 0.0


def _noise(random: np.random.Generator, contrast: float) -> NDArray[np.float32]:
    """Return a texture like print: blotches of several sizes with edges, grey levels."""
    total = np.zeros((_TEXTURE_PX, _TEXTURE_PX), np.float32)
    for cell, share in ((4, 0.5), (10, 0.8), (28, 1.0), (90, 1.0)):
        small = random.normal(size=(_TEXTURE_PX // cell + 2,) * 2).astype(np.float32)
        total += share * cv2.resize(small, (_TEXTURE_PX, _TEXTURE_PX), interpolation=cv2.INTER_CUBIC)
    return np.asarray(130 + contrast * 90 * np.tanh(1.2 * total), np.float32)


def _boards(take: Take) -> list[_Board]:
    random = np.random.default_rng([take.seed, 3])

    def board(
        z: float, x: float, y: float, half: float, *, tilt: float = 0.0, lean: float = 0.0, contrast: float = 0.6
    ) -> _Board:
        turn = rotations_of(np.array([lean, tilt, random.normal(0, 0.1)]))
        return _Board(np.array([x, y, z]), turn[:, 0] * half, turn[:, 1] * half, _noise(random, contrast))

    match take.place:
        case Place.POSTER:
            return [board(1.1, 0, 0, 1.4, tilt=random.uniform(-0.4, 0.4), lean=random.uniform(-0.2, 0.2))]
        case Place.SHELF:
            rows = [(x, y) for x in (-0.7, -0.2, 0.3, 0.8) for y in (-0.45, 0.05, 0.5)]
            things = [board(random.uniform(1.0, 1.7), x, y, 0.16, tilt=random.normal(0, 0.4)) for x, y in rows]
            return [board(1.9, 0, 0, 2.4, tilt=random.uniform(-0.3, 0.3)), *things]
        case Place.FAR:
            return [board(9.0, 0, 0, 11.0), board(7.0, 2.0, 0.5, 1.6), board(6.0, -2.4, -0.6, 1.4, tilt=0.3)]
        case Place.PLAIN:
            wall = _Board(
                np.array([0, 0, 2.0]),
                np.array([3.0, 0, 0]),
                np.array([0, 3.0, 0]),
                np.full((_TEXTURE_PX,) * 2, 150, np.float32),
            )
            return [wall, board(1.5, 0.1, 0.05, 0.09)]
        case Place.DESK:
            things = [
                board(
                    random.uniform(0.5, 0.8),
                    random.uniform(-0.4, 0.4),
                    random.uniform(-0.25, 0.2),
                    0.1,
                    tilt=random.normal(0, 0.4),
                )
                for _ in range(5)
            ]
            return [board(1.0, 0, 0.3, 1.6, lean=-0.9), board(2.2, 0, 0, 3.0), *things]
        case Place.ROOM:
            things = [
                board(
                    random.uniform(1.0, 2.3),
                    random.uniform(-0.9, 0.9),
                    random.uniform(-0.6, 0.6),
                    random.uniform(0.15, 0.3),
                    tilt=random.normal(0, 0.5),
                )
                for _ in range(6)
            ]
            return [board(3.0, 0, 0, 3.6, tilt=0.15), board(2.0, -1.6, 0, 1.8, tilt=1.1), *things]


def film(take: Take) -> Iterator[tuple[float, Image]]:
    """Render a film: moment of the middle row, s, and grey image, (H, W) uint8."""
    sensor = _sensor(take)
    boards, hand = _boards(take), Hand(take)
    smooth, random = _Smooth(take, hand), np.random.default_rng([take.seed, 4])
    if take.walker:
        cloth = _noise(random, 0.6)
        boards.append(
            _Board(np.array([0.25, 0.1, 0.9]), np.array([0.16, 0, 0]), np.array([0, 0.5, 0]), cloth, swing=0.25)
        )
    grid = np.stack(np.meshgrid(np.arange(sensor.width_px), np.arange(sensor.height_px)), -1).reshape(-1, 2)
    rays = (
        rays_through(grid.astype(np.float64), sensor).astype(np.float32).reshape(sensor.height_px, sensor.width_px, 3)
    )
    rows = (np.arange(sensor.height_px) / sensor.height_px - 0.5) * take.readout / take.fps
    for number in range(round(take.seconds * take.fps)):
        t_s = number / take.fps
        whole = _painted(boards, rays, hand.at(t_s + rows), t_s)
        image = _stabilised(take, sensor, whole, hand, smooth, t_s)
        gain = 1 + take.exposure * math.sin(math.tau * t_s / 2.3)
        levels = gain * image + random.normal(0, take.noise, image.shape)
        yield t_s, _sent(np.clip(levels, 0, 255).astype(np.uint8), take.jpeg)


def _painted(boards: list[_Board], rays: NDArray[np.float32], motion: Floats, t_s: float) -> NDArray[np.float32]:
    """Return what the sensor sees, each row at its own moment: motion (H, 6)."""
    turns = rotations_of(motion[:, :3]).astype(np.float32)
    towards = rays @ turns  # a row's camera axes to the scene's: R^T ray
    eye = motion[:, 3:].astype(np.float32)
    nearest = np.full(rays.shape[:2], np.inf, np.float32)
    image = np.full(rays.shape[:2], 90, np.float32)
    for board in boards:
        middle = (board.middle + np.array([board.swing * math.sin(math.tau * t_s / 1.9), 0, 0])).astype(np.float32)
        normal = np.cross(board.across, board.down)
        normal = (normal / np.linalg.norm(normal)).astype(np.float32)
        facing = towards @ normal
        depth = ((middle - eye) @ normal)[:, np.newaxis] / np.where(facing == 0, np.float32(1e-9), facing)
        half = float(np.linalg.norm(board.across)), float(np.linalg.norm(board.down))
        axes = [
            (side / length**2).astype(np.float32) for side, length in zip((board.across, board.down), half, strict=True)
        ]
        u, v = (((eye - middle) @ axis)[:, np.newaxis] + depth * (towards @ axis) for axis in axes)
        hit = (depth > 0) & (depth < nearest) & (np.abs(u) < 1) & (np.abs(v) < 1)
        scale = (_TEXTURE_PX - 1) / 2
        seen = cv2.remap(board.texture, (u + 1) * scale, (v + 1) * scale, cv2.INTER_LINEAR)
        nearest, image = np.where(hit, depth, nearest), np.where(hit, seen, image)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.6), np.float32)


def _stabilised(  # noqa: PLR0917 - what makes up a moment of the film
    take: Take, sensor: CameraModel, whole: NDArray[np.float32], hand: Hand, smooth: _Smooth, t_s: float
) -> NDArray[np.float32]:
    """Return the film's part of the sensor's image."""
    width, height = take.width_px, take.height_px
    left, top = (sensor.width_px - width) / 2, (sensor.height_px - height) / 2
    x, y = np.meshgrid(np.arange(width) + left, np.arange(height) + top)
    if take.stabiliser is Stabiliser.OFF:
        return np.asarray(cv2.remap(whole, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR), np.float32)
    k, now = sensor.matrix, np.array([t_s])
    wanted, real = smooth.at(now)[0], hand.at(now)[0, :3]
    off = real - wanted
    aside = k[0, 0] * np.array([off[1], -off[0]])  # where in the sensor's image the wanted middle is
    places = np.stack([x, y], -1) - k[:2, 2]
    match take.stabiliser:
        case Stabiliser.SHIFT:
            source = places + aside
        case Stabiliser.ZOOM:
            source = places * (1 - np.abs(aside).max() / width) + aside
        case Stabiliser.SIMILARITY:
            cosine, sine = math.cos(off[2]), math.sin(off[2])
            source = places @ np.array([[cosine, sine], [-sine, cosine]]) + aside
        case _:
            whole_rows = take.stabiliser is Stabiliser.ROWS
            rows = (
                (np.arange(height) / height - 0.5) * take.readout / take.fps * CROP if whole_rows else np.zeros(height)
            )
            turns = rotations_of(hand.at(t_s + rows)[:, :3]) @ rotations_of(wanted).T
            rays = np.concatenate([places / np.array([k[0, 0], k[1, 1]]), np.ones((height, width, 1))], -1)
            turned = rays @ np.swapaxes(turns, 1, 2)
            source = turned[..., :2] / turned[..., 2:] * np.array([k[0, 0], k[1, 1]])
    at = (source + k[:2, 2]).astype(np.float32)
    made = cv2.remap(whole, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(made, np.float32)


def _sent(image: Image, quality: int) -> Image:
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)
