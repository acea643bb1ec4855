"""Turns a camera's images upright. The board sends them as its camera gives them; only decoded images are turned."""

from typing import Final

import cv2
import numpy as np

from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.model import Image

_TURNS: Final = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
_FLIPS: Final = {Flip.H: 1, Flip.V: 0}


def upright(image: Image, orientation: Orientation) -> Image:
    """Turn, then mirror, a decoded image.

    Args:
        image: (H, W) or (H, W, 3), uint8, as the camera gave it.
        orientation: how its camera is mounted.

    Returns:
        The upright image; the image itself if there is nothing to do.
    """
    if orientation == UPRIGHT:
        return image
    turned = cv2.rotate(image, _TURNS[orientation.rotate_deg]) if orientation.rotate_deg else image
    flipped = cv2.flip(turned, _FLIPS[orientation.flip]) if orientation.flip is not Flip.NONE else turned
    return np.asarray(flipped, np.uint8)
