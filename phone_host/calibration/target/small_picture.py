"""Makes images small: to be searched, or for a page, of which 40 take half a megabyte. Pure."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

PREVIEW_PX: Final = 320
"""Longer side of a view's small picture, px."""

_QUALITY: Final = 70
"""Squares still have sharp edges."""


def small_size(size_px: tuple[int, int], most_px: int) -> tuple[int, int]:
    """Return width and height of an image whose longer side is at most `most_px`; never enlarged."""
    share = min(1.0, most_px / max(size_px))
    return max(1, round(size_px[0] * share)), max(1, round(size_px[1] * share))


def shrunk_to(image: Image, size_px: tuple[int, int]) -> Image:
    """Return an image at a smaller size, each pixel the mean of those it covers."""
    if (image.shape[1], image.shape[0]) == size_px:
        return image
    return np.asarray(cv2.resize(image, size_px, interpolation=cv2.INTER_AREA), np.uint8)


def shrunk(image: Image, scale: float) -> tuple[Image, NDArray[np.float64]]:
    """Return an image at a smaller size (scale 0 to 1; 1 gives the image itself), and by what its columns and rows were really multiplied."""
    width, height = image.shape[1], image.shape[0]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return shrunk_to(image, size), np.array([size[0] / width, size[1] / height])


def small_jpeg(image: Image, most_px: int) -> bytes:
    """Make an image into a JPEG file whose longer side is at most `most_px`."""
    small = shrunk_to(image, small_size((image.shape[1], image.shape[0]), most_px))
    return cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
