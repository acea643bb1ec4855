"""Corners of an image, and where they went in the next one. Pure.

Sources: J. Shi and C. Tomasi, "Good Features to Track", 1994; J.-Y. Bouguet, "Pyramidal Implementation of the Lucas Kanade
Feature Tracker", 2000.
"""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

Pixels = NDArray[np.float32]
Flags = NDArray[np.bool_]

_QUALITY: Final = 0.005
"""Share of the strongest corner's response; below it dim images would give noise."""

_BLOCK_PX: Final = 5
_WINDOW_PX: Final = (21, 21)
_LEVELS: Final = 4
"""Halvings of the image: a corner is followed over some 150 px."""

_STOP: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)

_THERE_AND_BACK_PX: Final = 0.8
"""A corner that is followed back must come out this near to where it began."""

_BORDER_PX: Final = 2


def new_corners(grey: Image, held: Pixels, most: int, apart_px: int, wanted: Flags | None = None) -> Pixels:
    """Find corners where none is held yet.

    Args:
        grey: (H, W) uint8.
        held: (N, 2) those that are held, px.
        most: how many may be held in all.
        apart_px: least distance of two.
        wanted: (H, W) where corners are of use; None: everywhere.

    Returns:
        (M, 2) float32, px, the strongest first; M <= most - N.
    """
    room = most - len(held)
    if room <= 0:
        return np.zeros((0, 2), np.float32)
    mask = np.full(grey.shape, 255, np.uint8) if wanted is None else np.where(wanted, np.uint8(255), np.uint8(0))
    for x, y in np.rint(held).astype(int).tolist():
        cv2.circle(mask, (x, y), apart_px, 0, -1)
    found: object = cv2.goodFeaturesToTrack(grey, room, _QUALITY, apart_px, mask=mask, blockSize=_BLOCK_PX)
    return np.zeros((0, 2), np.float32) if found is None else np.asarray(found, np.float32).reshape(-1, 2)


def followed(before: Image, after: Image, pixels: Pixels) -> tuple[Pixels, Flags]:
    """Follow corners into the next image, and back again.

    Args:
        before: (H, W) uint8, the image they are in.
        after: the next, of the same size.
        pixels: (N, 2) float32, px.

    Returns:
        (N, 2) where they went, px, and (N,) which of them were followed.
    """
    if len(pixels) == 0:
        return pixels, np.zeros(0, np.bool_)
    there, found = _flow(before, after, pixels)
    back, found_back = _flow(after, before, there)
    height, width = after.shape
    inside = (there >= _BORDER_PX).all(axis=1) & (there < (width - _BORDER_PX, height - _BORDER_PX)).all(axis=1)
    near = np.linalg.norm(back - pixels, axis=1) < _THERE_AND_BACK_PX
    return there, found & found_back & near & inside


def _flow(one: Image, other: Image, pixels: Pixels) -> tuple[Pixels, Flags]:
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        one, other, pixels, np.empty_like(pixels), winSize=_WINDOW_PX, maxLevel=_LEVELS, criteria=_STOP
    )
    return np.asarray(there, np.float32).reshape(-1, 2), np.asarray(found).reshape(-1) > 0
