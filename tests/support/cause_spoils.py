"""What spoils images of a board: defocus, motion, a lamp's reflection."""

from collections.abc import Callable

import cv2
import numpy as np

from phone_host.model import Image


def blurring(random: np.random.Generator, *, moving: bool) -> Callable[[Image], Image]:
    """Return what puts an image out of focus, or smears it along a random direction."""

    def spoil(image: Image) -> Image:
        if not moving:
            sigma = random.uniform(3.0, 5.0)
            return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.uint8)
        length = int(random.uniform(11, 19))
        kernel = np.zeros((length, length), np.float32)
        kernel[length // 2] = 1 / length
        turn = cv2.getRotationMatrix2D((length // 2, length // 2), random.uniform(0, 180), 1)
        kernel = np.asarray(cv2.warpAffine(kernel, turn, (length, length)), np.float32)
        return np.asarray(cv2.filter2D(image, -1, kernel / kernel.sum()), np.uint8)

    return spoil


def glaring(random: np.random.Generator) -> Callable[[Image], Image]:
    """Return what shines a lamp on an image, where it is dark: on a square, if the board fills it."""

    def spoil(image: Image) -> Image:
        dark = np.argwhere(cv2.erode(image, np.ones((5, 5), np.uint8)) < 60)
        y, x = dark[random.integers(len(dark))] if len(dark) else (image.shape[0] / 2, image.shape[1] / 2)
        spread = float(np.ptp(dark, axis=0).max()) * random.uniform(0.15, 0.3) if len(dark) else 60.0
        return lit(image, (float(x), float(y)), spread)

    return spoil


def lit(image: Image, at_px: tuple[float, float], spread_px: float) -> Image:
    """Return an image with the reflection of a lamp at a place."""
    rows_at, columns_at = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    light = 450 * np.exp(-((rows_at - at_px[1]) ** 2 + (columns_at - at_px[0]) ** 2) / (2 * spread_px**2))
    return np.asarray(np.clip(image + light, 0, 255), np.uint8)
