"""Small real image files, written by OpenCV, so that the product's own readers are tested against a different writer."""

import cv2
import numpy as np

from phone_host.model import Image


def picture(width_px: int = 32, height_px: int = 24, seed: int = 0) -> Image:
    """A colour image of smooth noise, (H, W, 3) uint8, different for each seed."""
    random = np.random.default_rng(seed)
    coarse = random.integers(0, 256, (4, 5, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(coarse, (width_px, height_px), interpolation=cv2.INTER_CUBIC), np.uint8)


def encoded(suffix: str, image: Image | np.ndarray[tuple[int, ...], np.dtype[np.uint16]]) -> bytes:
    """The image as the bytes of a file with that suffix."""
    done, data = cv2.imencode(suffix, image)
    assert done
    return data.tobytes()


def jpeg(width_px: int = 32, height_px: int = 24, seed: int = 0) -> bytes:
    """The bytes of a JPEG file."""
    return encoded(".jpg", picture(width_px, height_px, seed))
