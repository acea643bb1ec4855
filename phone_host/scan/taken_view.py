"""A pair as a scan takes it. Pure."""

from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.model import Processed, StereoGeometry
from phone_host.scan.mat import Mat
from phone_host.scan.view import Depth, View
from phone_host.stereo.images import size_px, to_grey

NOISE_PX: Final = 0.5
"""Of a matcher's disparity, px of the images that it matched: 0.25 on rendered scenes, 0.7 on a street (decision 0068)."""
_STEP_PX: Final = 1.5
"""A rise of the disparity from pixel to pixel: a table 0.3 m below the cameras gives 0.3 px, the outline of a cup 5 px."""


def require_size(name: str, view: View, size: tuple[int, int]) -> None:
    """Refuse a view of another size than those before it.

    Args:
        name: of its pair.
        view: that was taken.
        size: width and height of those before it, px.

    Raises:
        DataError: so it is.
    """
    if size_px(view.grey) != size:
        here, before = (size_text(each) for each in (size_px(view.grey), size))
        raise DataError(f"{name} is {here} px when rectified, the first pair {before} px", "scan with one size")


def view_of(processed: Processed, mat: Mat | None = None) -> View:
    """Return a pair as the tracker takes it, without the depths beside steps.

    Args:
        processed: with disparity and cloud.
        mat: that is looked for in both images; None: none is.
    """
    assert processed.geometry is not None
    assert processed.cloud is not None
    left = processed.pair.left
    scale = 1.0 if processed.search is None else processed.search.scale
    return View(
        grey=to_grey(left),
        colours=left if left.ndim == 3 else np.repeat(left[..., np.newaxis], 3, axis=2),
        depth_m=without_edges(processed.cloud[..., 2], processed.geometry),
        geometry=processed.geometry,
        noise_px=NOISE_PX / scale,
        right=None if mat is None else to_grey(processed.pair.right),
        epipolar=processed.pair.epipolar,
        confidence=None if mat is None else processed.confidence,
    )


def without_edges(depth_m: Depth, geometry: StereoGeometry) -> Depth:
    """Leave out the depths beside a step, where a matcher's window sees both sides.

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
