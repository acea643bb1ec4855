"""One pair of a series after rectification, made small: what a matcher will see. Reads the pair's files once more."""

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError
from common.imagesize.head import MOST_PIXELS
from common.orientation import UPRIGHT, Orientation
from phone_host.calibration.target.corners import Corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.small_picture import shrunk_to, small_jpeg, small_size
from phone_host.model import CameraModel, Rectification, Rig
from phone_host.model.calibration_series import RectifiedView
from phone_host.stereo.images import decode_file, open_image
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_points
from phone_host.stereo.scaled_rig import scaled_rig

_MOST_PX: Final = 640
"""Longer side of the images that are rectified, px: enough for a page, and rectifying 12 megapixels takes a second."""


def fullest(pairs: list[BoardPair], rig: Rig, rectification: Rectification) -> BoardPair:
    """Return the pair whose board fills most of both rectified images and is whole in them."""

    def filled(pair: BoardPair) -> tuple[float, float]:
        shares, areas = [], []
        for corners, model, turn in (
            (pair.left_px, rig.left, rectification.R_left),
            (pair.right_px, rig.right, rectification.R_right),
        ):
            seen = corners[np.isfinite(corners).all(axis=1)]
            at = rectify_points(seen, model, turn, rectification.geometry)
            inside = np.all((at > 0) & (at < (rectification.width_px - 1, rectification.height_px - 1)), axis=1)
            shares.append(float(inside.sum()) / len(corners))
            areas.append(float(np.prod(np.ptp(at, axis=0))))
        return round(min(shares), 2), min(areas)

    return max(pairs, key=filled)


def rectified_view(
    files: tuple[Path, Path],
    pair: BoardPair,
    rig: Rig,
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT),
    most_pixels: int = MOST_PIXELS,
) -> RectifiedView | None:
    """Rectify one pair at a small size.

    Returns:
        The pair; None if a file has gone, or the rig cannot be rectified so small.
    """
    sizes = [small_size((model.width_px, model.height_px), _MOST_PX) for model in (rig.left, rig.right)]
    try:
        images = [
            shrunk_to(decode_file(open_image(path, most_pixels, turn)), size)
            for path, turn, size in zip(files, mounted, sizes, strict=True)
        ]
        small = scaled_rig(replace(rig, is_cropped=False), sizes[0], sizes[1])
        rectifier = Rectifier(small)
    except DataError:
        return None
    rectified = rectifier.rectify(images[0], images[1])
    made, geometry = rectifier.rectification, rectifier.geometry
    seen = np.isfinite(pair.left_px).all(axis=1) & np.isfinite(pair.right_px).all(axis=1)
    corners = [
        rectify_points(_scaled(own_px[seen], own, model), model, turn, geometry)
        for own_px, own, model, turn in (
            (pair.left_px, rig.left, small.left, made.R_left),
            (pair.right_px, rig.right, small.right, made.R_right),
        )
    ]
    return RectifiedView(
        name=pair.name,
        left=small_jpeg(rectified.left, _MOST_PX),
        right=small_jpeg(rectified.right, _MOST_PX),
        size_px=(made.width_px, made.height_px),
        left_px=corners[0],
        right_px=corners[1],
        is_vertical=made.epipolar.is_vertical,
    )


def _scaled(corners_px: Corners, own: CameraModel, small: CameraModel) -> Corners:
    """Return corners in a smaller copy of their image; pixel centres are integers."""
    scale = np.array([small.width_px / own.width_px, small.height_px / own.height_px])
    return np.asarray((corners_px + 0.5) * scale - 0.5, np.float64)
