"""What a webcam shows of a board that hands hold: quick enough for a camera that paints while it runs, corners right to 0.02 px.

The board is looked up in its texture through each pixel's own ray. A picture is the mean of several moments of its exposure, each
also at another place within the pixel: that is the motion blur, and it smooths edges. Then come defocus, the room behind, the
lens's vignette, shot and read noise.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Image
from tests.support.novice.hands import GRIPS
from tests.support.novice.print_of_board import GREY_OF_PAPER, Level, outline, printed
from tests.support.novice.scene import Eye

Floats = NDArray[np.float64]

_COARSE: Final = 2
"""Pixels per ray that is solved; lines between them are off by 1e-3 px. OpenCV's cubic does not keep even a straight line straight."""

_SPARSE, _PAD_PX = 8, 16
"""Pixels between the rays by which a board's place in the image is found, and around that place."""

_OPTICS_PX: Final = 0.55
"""Sigma of the blur of any lens and of the sensor's filter, px."""

_MOMENTS: Final = 6
"""Most moments of one exposure."""

_STEP_PX: Final = 1.5
"""Longest way between two of them; farther apart, each is smeared along the way."""

_READ, _PER_ELECTRON = 1.4, 45.0
"""Read noise in grey levels; grey levels whose shot noise is as large as one level squared."""

_LAMP: Final = np.array([-0.3, -0.6, -0.74])
"""Direction to the lamp: behind the cameras, above."""

_NO_MAP: Final = np.empty(0, np.float32)
"""Rows and columns come in one array."""

_NEAREST_M: Final = 0.04
_BANK_PX: Final = 64


@dataclass(frozen=True, slots=True)
class Moment:
    """Where the board is at one instant of the exposure: `pose` takes its coordinates to the camera's axes."""

    pose: SE3
    grip: int = 0


class Painter:
    """Paints the pictures of one camera.

    Args:
        eye: the camera.
        board: the board.
        seed: of room and noise.
    """

    def __init__(self, eye: Eye, board: Board, seed: int) -> None:
        self._eye, self._board = eye, board
        self._random = np.random.default_rng([seed, eye.model.width_px])
        self._rays = _slopes(eye.model)
        self._prints = [printed(board, grip) for grip in range(GRIPS)]
        self._shade = _vignette(eye.model) * (eye.brightness / GREY_OF_PAPER)
        self._room = (_room(eye.model, self._random) * self._shade).astype(np.float32)
        size = (eye.model.height_px + _BANK_PX, eye.model.width_px + _BANK_PX)
        self._noise = self._random.standard_normal(size).astype(np.float32)
        self._sigma = np.sqrt(_READ**2 + np.arange(256) / _PER_ELECTRON).astype(np.float32)

    def paint(self, moments: tuple[Moment, ...]) -> Image:
        """Paint one picture.

        Args:
            moments: instants spread evenly over the exposure, from one on; how many are needed tells `moments_for`.

        Returns:
            (H, W) uint8.
        """
        seen = self._room.copy()
        middle = moments[len(moments) // 2].pose
        box = self._box([each.pose for each in moments])
        if box is not None:
            x0, y0, x1, y1 = box
            layer = self._layer(moments, box) * (1 / len(moments))
            sigma = self._blur_px(middle)
            layer = np.asarray(cv2.GaussianBlur(layer, (0, 0), sigma), np.float32)
            value, opacity = cv2.split(layer)
            light = 0.6 + 0.4 * abs(float(middle.R[:, 2] @ _LAMP))
            there = np.s_[y0:y1, x0:x1]
            seen[there] = seen[there] * (1 - opacity * (1 / 255)) + value * self._shade[there] * light
        return self._noisy(seen)

    def moments_for(self, first: SE3, last: SE3) -> int:
        """Return how many moments an exposure needs from its first to its last pose, 2 to 6."""
        return int(np.clip(np.ceil(self._way_px(first, last) / _STEP_PX), 2, _MOMENTS))

    def _way_px(self, first: SE3, last: SE3) -> float:
        return float(np.linalg.norm(self._way(first, last)))

    def _way(self, first: SE3, last: SE3) -> Floats:
        """Return how far the board's middle moves in the image, px."""
        middle = self._board.points_m().mean(axis=0)
        ends = np.array([each.apply(middle) for each in (first, last)])
        ends = ends[:, :2] / np.maximum(ends[:, 2:], _NEAREST_M)
        return np.asarray((ends[1] - ends[0]) * self._eye.model.matrix[0, 0])

    def _blur_px(self, pose: SE3) -> float:
        depth_m = max(_NEAREST_M, float(pose.apply(self._board.points_m().mean(axis=0))[2]))
        return float(np.hypot(_OPTICS_PX, self._eye.aperture_px * (1 / depth_m - 1 / self._eye.sharp_m)))

    def _box(self, poses: list[SE3]) -> tuple[int, int, int, int] | None:
        """Return the pixels that the texture may cover: left, top, right, bottom; None: it is out of sight."""
        ends = outline(self._board)
        along = np.linspace(0, 1, 9)[:, np.newaxis]
        rim = np.concatenate([a + (b - a) * along for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)])
        points = np.column_stack([rim, np.zeros(len(rim))]) * self._board.square_m
        seen = np.concatenate([pose.apply(points) for pose in (poses[0], poses[-1])])
        model = self._eye.model
        if (seen[:, 2] < _NEAREST_M).any():
            middle = poses[0].apply(self._board.points_m().mean(axis=0))
            return None if middle[2] < _NEAREST_M else (0, 0, model.width_px, model.height_px)
        # Beyond the image the lens's polynomial turns back on itself; what lies there is cut off without it.
        slopes = seen[:, :2] / seen[:, 2:]
        low, high = slopes.min(axis=0), slopes.max(axis=0)
        rays = self._rays[::_SPARSE, ::_SPARSE]
        inside = ((rays >= low) & (rays <= high)).all(axis=2)
        rows, columns = np.flatnonzero(inside.any(axis=1)) * _SPARSE, np.flatnonzero(inside.any(axis=0)) * _SPARSE
        if not len(rows):
            return None
        return (
            max(0, int(columns[0]) - _PAD_PX),
            max(0, int(rows[0]) - _PAD_PX),
            min(model.width_px, int(columns[-1]) + 1 + _PAD_PX),
            min(model.height_px, int(rows[-1]) + 1 + _PAD_PX),
        )

    def _layer(self, moments: tuple[Moment, ...], box: tuple[int, int, int, int]) -> NDArray[np.float32]:
        """Return the sum of the moments' layers, (h, w, 2)."""
        x0, y0, x1, y1 = box
        rays = self._rays[y0:y1, x0:x1]
        total = np.zeros((y1 - y0, x1 - x0, 2), np.float32)
        for moment, offset in zip(moments, _places(len(moments)), strict=True):
            level = self._level(moment)
            to_texels = self._to_texels(moment.pose, level, offset)
            places = cv2.perspectiveTransform(rays, to_texels)
            cv2.accumulate(cv2.remap(level.layer, places, _NO_MAP, cv2.INTER_LINEAR), total)
        way = self._way(moments[0].pose, moments[-1].pose) / max(1, len(moments) - 1)
        if np.linalg.norm(way) > 2 * _STEP_PX:
            total = np.asarray(cv2.filter2D(total, -1, _smear(way)), np.float32)
        return total

    def _level(self, moment: Moment) -> Level:
        """Return the texture whose texels are nearest to a pixel, rather smaller."""
        depth_m = max(_NEAREST_M, float(moment.pose.apply(self._board.points_m().mean(axis=0))[2]))
        square_px = self._eye.model.matrix[0, 0] * self._board.square_m / depth_m
        levels = self._prints[moment.grip]
        return next((each for each in reversed(levels) if each.texels >= square_px), levels[0])

    def _to_texels(self, pose: SE3, level: Level, offset_px: Floats) -> Floats:
        """Return the matrix that takes rays (x, y, 1) to texels, for samples that lie beside the pixels' middles."""
        to_rays = np.column_stack([pose.R[:, 0] * self._board.square_m, pose.R[:, 1] * self._board.square_m, pose.t_m])
        beside = np.eye(3)
        beside[:2, 2] = offset_px / self._eye.model.matrix[0, 0]
        return np.asarray(level.from_squares() @ np.linalg.inv(to_rays) @ beside)

    def _noisy(self, seen: NDArray[np.float32]) -> Image:
        height, width = seen.shape
        down, along = self._random.integers(0, _BANK_PX, 2)
        flat = cv2.convertScaleAbs(seen)
        noise = self._noise[down : down + height, along : along + width]
        return np.asarray(cv2.add(seen, cv2.LUT(flat, self._sigma) * noise, dtype=cv2.CV_8U), np.uint8)


def _places(count: int) -> Floats:
    """Return where within the pixel each of some samples lies, px: in sum nowhere, and not along the time either."""
    corners = np.array([[-0.25, -0.25], [0.25, 0.25], [0.25, -0.25], [-0.25, 0.25]])
    if count == 2:  # one diagonal has no direction in time
        return corners[:2]
    places = np.resize(corners, (count, 2))
    return np.asarray(places - places.mean(axis=0))


def _smear(way: Floats) -> Floats:
    """Return the kernel of a movement by `way`, px."""
    reach = int(np.ceil(np.abs(way).max() / 2))
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    for t in np.linspace(-0.5, 0.5, 4 * reach + 1):
        x, y = way * t + reach
        kernel[round(float(y)), round(float(x))] += 1
    return np.asarray(kernel / kernel.sum())


def _slopes(model: CameraModel) -> NDArray[np.float32]:
    """Return each pixel's ray, (H, W, 2): x / z and y / z."""
    columns = np.arange(0, model.width_px + 2 * _COARSE, _COARSE) + (_COARSE - 1) / 2 - _COARSE
    rows = np.arange(0, model.height_px + 2 * _COARSE, _COARSE) + (_COARSE - 1) / 2 - _COARSE
    grid = np.stack(np.meshgrid(columns, rows), axis=2)
    coarse = rays_through(grid.reshape(-1, 2), model)[:, :2].reshape(grid.shape).astype(np.float32)
    size = (len(columns) * _COARSE, len(rows) * _COARSE)
    fine = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(fine[_COARSE : _COARSE + model.height_px, _COARSE : _COARSE + model.width_px])


def _vignette(model: CameraModel) -> NDArray[np.float32]:
    """Return the share of light that each pixel gets: cos^4 of the angle to the axis."""
    x = (np.arange(model.width_px) - model.matrix[0, 2]) / model.matrix[0, 0]
    y = (np.arange(model.height_px) - model.matrix[1, 2]) / model.matrix[1, 1]
    return np.asarray((1 + np.add.outer(y**2, x**2)) ** -2, np.float32)


def _room(model: CameraModel, random: np.random.Generator) -> NDArray[np.float32]:
    """Paint what stands behind the board: plaster, furniture, books, and the person."""
    size = (model.width_px, model.height_px)
    room = np.full(size[::-1], 95, np.float32)
    for cells, levels in ((4, 30), (16, 10), (90, 8), (260, 5)):
        noise = random.standard_normal((cells * 3 // 4, cells)).astype(np.float32) * levels
        room += cv2.resize(noise, size, interpolation=cv2.INTER_CUBIC)
    for _ in range(14):
        x, y = (int(random.uniform(0, side)) for side in size)
        wide, high = (int(random.uniform(0.02, 0.2) * side) for side in size)
        cv2.rectangle(room, (x, y), (x + wide, y + high), float(random.uniform(25, 200)), -1)
    x = int(size[0] * random.uniform(0.4, 0.6))
    cv2.ellipse(room, (x, size[1]), (size[0] // 5, size[1] // 2), 0, 0, 360, float(random.uniform(40, 90)), -1)
    cv2.ellipse(room, (x, size[1] // 3), (size[0] // 14, size[1] // 8), 0, 0, 360, 135.0, -1)
    return np.asarray(np.clip(cv2.GaussianBlur(room, (0, 0), 1.2), 5, 235), np.float32)
