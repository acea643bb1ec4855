"""Pairs of flat layers at whole-pixel disparities, each with a texture of its own: exact truth, quickly made."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image, RectifiedPair
from tests.support.planes import noise

NOISE_SIGMA = 1.0
"""Grey levels, of each image on its own: as a webcam in good light."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """A rectangle that faces the cameras.

    Attributes:
        disparity: px.
        x: left edge in the left image, px.
        y: upper edge, px.
        width: px.
        height: px.
        seed: selects its texture.
    """

    disparity: int
    x: int = 0
    y: int = 0
    width: int = 10_000
    height: int = 10_000
    seed: int = 1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Layers:
    """A pair and its truth.

    Attributes:
        pair: uint8 grey.
        disparity: (H, W) float32, px.
        visible: (H, W) bool: both cameras see the point.
    """

    pair: RectifiedPair
    disparity: Disparity
    visible: NDArray[np.bool_]


def layers(
    front_to_back: Sequence[Layer], *, width_px: int = 320, height_px: int = 240, sensor_seed: int = 0
) -> Layers:
    """Render layers; the last one should fill both images.

    Args:
        front_to_back: the nearest first.
        width_px: of both images.
        height_px: of both images.
        sensor_seed: selects the noise of the two sensors.
    """
    left, right = np.zeros((height_px, width_px)), np.zeros((height_px, width_px))
    disparity = np.zeros((height_px, width_px), np.float32)
    owner_left, owner_right = (np.full((height_px, width_px), -1) for _ in range(2))
    for number, layer in reversed(list(enumerate(front_to_back))):
        texture = _texture(width_px + layer.disparity, height_px, layer.seed)
        rows = slice(layer.y, layer.y + layer.height)
        # Column c of the texture lies at c in the left image and at c - d in the right one.
        seen_left = slice(layer.x, min(layer.x + layer.width, width_px))
        seen_right = slice(
            max(layer.x - layer.disparity if layer.x else 0, 0),
            max(min(layer.x + layer.width - layer.disparity, width_px), 0),
        )
        left[rows, seen_left] = texture[rows, :width_px][:, seen_left]
        right[rows, seen_right] = texture[rows, layer.disparity :][:, seen_right]
        disparity[rows, seen_left] = layer.disparity
        owner_left[rows, seen_left], owner_right[rows, seen_right] = number, number
    y, x = np.mgrid[:height_px, :width_px]
    there = x - disparity.astype(int)
    visible = (there >= 0) & (owner_right[y, np.maximum(there, 0)] == owner_left)
    rng = np.random.default_rng(sensor_seed)

    def seen(image: NDArray[np.float64]) -> Image:
        return np.clip(np.rint(image + rng.normal(0, NOISE_SIGMA, image.shape)), 0, 255).astype(np.uint8)

    return Layers(pair=RectifiedPair(seen(left), seen(right)), disparity=disparity, visible=visible)


def _texture(width_px: int, height_px: int, seed: int) -> Image:
    """Noise of several sizes, so that it can be matched at full size and at a quarter of it."""
    total = np.zeros((height_px, width_px))
    for sigma in (1.0, 3.0, 8.0):
        part = cv2.GaussianBlur(noise(width_px, height_px, seed).astype(np.float32), (0, 0), sigma)
        total += (part - part.mean()) / part.std()
    return np.clip(128 + 25 * total, 0, 255).astype(np.uint8)
