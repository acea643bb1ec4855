"""Depths beside a step, where a matcher's window sees both sides: what it says there belongs to neither. Pure."""

from typing import Final

import cv2
import numpy as np

from phone_host.model import StereoGeometry
from phone_host.scan.view import Depth

_STEP_PX: Final = 1.5
"""A rise of the disparity from pixel to pixel: a table 0.3 m below the cameras gives 0.3 px, the outline of a cup 5 px."""


def without_edges(depth_m: Depth, geometry: StereoGeometry) -> Depth:
    """Leave out the depths beside a step.

    Args:
        depth_m: (H, W) float32, m, NaN = none.
        geometry: of the rectified pair.

    Returns:
        (H, W) float32, m: the same, NaN where a neighbour's disparity is more than 1.5 px away.
    """
    with np.errstate(divide="ignore"):
        disparity = np.float32(geometry.focal_px * geometry.baseline_m) / depth_m
    known, around = np.isfinite(disparity), np.ones((3, 3), np.uint8)
    highest = cv2.dilate(np.where(known, disparity, np.float32(-np.inf)), around)
    lowest = cv2.erode(np.where(known, disparity, np.float32(np.inf)), around)
    flat = known & (
        np.maximum(highest - disparity, disparity - lowest, where=known, out=np.zeros_like(disparity)) <= _STEP_PX
    )
    return np.where(flat, depth_m, np.float32(np.nan))
