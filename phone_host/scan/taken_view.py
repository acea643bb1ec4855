"""A pair as a scan takes it. Pure."""

from typing import Final

import numpy as np

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.model import Processed
from phone_host.scan.depth_edges import without_edges
from phone_host.scan.mat import Mat
from phone_host.scan.view import View
from phone_host.stereo.images import size_px, to_grey

NOISE_PX: Final = 0.5
"""Of a matcher's disparity, px of the images that it matched: 0.25 on rendered scenes, 0.7 on a street (decision 0068)."""


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
