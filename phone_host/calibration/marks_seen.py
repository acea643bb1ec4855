"""Recognises boards of coded marks (ChArUco, AprilGrid) where a chessboard was looked for. Pure."""

from collections import Counter
from typing import Final

import cv2
import numpy as np

from phone_host.model import Image

_FAMILIES: Final = {
    "ArUco 4x4": cv2.aruco.DICT_4X4_1000,
    "ArUco 5x5": cv2.aruco.DICT_5X5_1000,
    "ArUco 6x6": cv2.aruco.DICT_6X6_1000,
    "AprilTag 36h11": cv2.aruco.DICT_APRILTAG_36h11,
}
_LEAST: Final = 3
"""In noise single marks of the large 4x4 family are seen; never several in one image."""


def marks_seen(images: list[Image | None]) -> str:
    """Say which marks most images show; empty if none.

    Args:
        images: (H, W) uint8 grey; None: could not be read.
    """
    votes = Counter[str]()
    for grey in (image for image in images if image is not None):
        for name, family in _FAMILIES.items():
            detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(family))
            corners, ids, _ = detector.detectMarkers(grey)
            count = np.unique(ids).size if len(corners) else 0
            if count >= _LEAST:
                votes[name] += count
    return f"marks of the family {votes.most_common(1)[0][0]}" if votes else ""
