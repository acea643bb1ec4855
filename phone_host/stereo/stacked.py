"""Turns what a matcher sees: images of cameras that stand one above the other are laid on their side and back. Pure.

Matchers search to the left along rows (`match`). A quarter turn brings the direction in which a point moves from the
left image to the right one to the left. No pixel is interpolated.
"""

from typing import Final, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Epipolar, RectifiedPair

Values = TypeVar("Values", np.uint8, np.float32)

_LYING: Final = {Epipolar.UP: cv2.ROTATE_90_COUNTERCLOCKWISE, Epipolar.DOWN: cv2.ROTATE_90_CLOCKWISE}
_BACK: Final = {Epipolar.UP: cv2.ROTATE_90_CLOCKWISE, Epipolar.DOWN: cv2.ROTATE_90_COUNTERCLOCKWISE}


def lying(image: NDArray[Values], epipolar: Epipolar) -> NDArray[Values]:
    """Turn an upright image so that its epipolar lines become rows and points move to the left.

    Args:
        image: (H, W) or (H, W, 3).
        epipolar: which way the lines run in it.

    Returns:
        (W, H) or (W, H, 3); the image itself if its lines are rows.
    """
    return np.asarray(cv2.rotate(image, _LYING[epipolar]), image.dtype) if epipolar.is_vertical else image


def lying_pair(pair: RectifiedPair) -> RectifiedPair:
    """Turn both images of a pair as `lying` does; its epipolar lines become rows.

    Returns:
        The pair with points that move to the left; the pair itself if they do already.
    """
    if not pair.epipolar.is_vertical:
        return pair
    return RectifiedPair(lying(pair.left, pair.epipolar), lying(pair.right, pair.epipolar))


def upright_again(values: NDArray[Values], epipolar: Epipolar) -> NDArray[Values]:
    """Undo `lying`.

    Args:
        values: (W, H) or (W, H, 3).
        epipolar: which way the lines run in the upright image.

    Returns:
        (H, W) or (H, W, 3).
    """
    return np.asarray(cv2.rotate(values, _BACK[epipolar]), values.dtype) if epipolar.is_vertical else values


def upright_points(points_px: NDArray[np.float64], epipolar: Epipolar, size_px: tuple[int, int]) -> NDArray[np.float64]:
    """Return where points of a lying image are in the upright one.

    Args:
        points_px: (N, 2), px of the lying image.
        epipolar: which way the lines run in the upright one.
        size_px: width and height of the upright image.
    """
    if not epipolar.is_vertical:
        return points_px
    far = np.array([size_px[0] - 1.0, 0.0]) if epipolar is Epipolar.UP else np.array([0.0, size_px[1] - 1.0])
    return np.asarray(upright_steps(points_px, epipolar) + far, np.float64)


def upright_steps(steps: NDArray[np.float64], epipolar: Epipolar) -> NDArray[np.float64]:
    """Return steps of a lying image, (N, 2), as they are in the upright one."""
    if not epipolar.is_vertical:
        return steps
    x, y = steps.T
    return np.column_stack([-y, x] if epipolar is Epipolar.UP else [y, -x])
