"""The checks that every matcher makes on its input, in one place."""

import cv2
import numpy as np

from common.errors import DataError
from phone_host.model import Image, RectifiedPair


def check_pair(pair: RectifiedPair) -> None:
    """Refuse a pair that no matcher can work on.

    Args:
        pair: two uint8 images, (H, W) or (H, W, 3), each grey or BGR on its own.

    Raises:
        DataError: the sizes differ, an image is empty, or it is neither grey nor BGR of 8 bits.
    """
    for side, image in (("left", pair.left), ("right", pair.right)):
        grey_or_bgr = image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)
        if image.dtype != np.uint8 or not grey_or_bgr or image.size == 0:
            raise DataError(
                f"the {side} image is {image.dtype} of shape {image.shape}",
                "matchers take uint8 images, grey (H, W) or BGR (H, W, 3), of at least one pixel",
            )
    left, right = pair.left.shape[:2], pair.right.shape[:2]
    if left != right:
        raise DataError(
            f"left image is {left[1]}x{left[0]}, right image is {right[1]}x{right[0]}",
            "rectify the pair to one size first (--calibration rig.yaml)",
        )


def grey(image: Image) -> Image:
    """Return the image as (H, W) uint8 grey; a grey one is returned as it is, or as a copy if its rows overlap in memory.

    Args:
        image: (H, W) grey or (H, W, 3) BGR, uint8.
    """
    if image.shape[0] > 1 and image.strides[0] < image[0].nbytes:  # OpenCV refuses such rows
        image = np.ascontiguousarray(image)
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
