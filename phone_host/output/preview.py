"""Shows disparity and depth as pictures: near is bright, far is dark, no value is black; a scale on the right."""

from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity, Image, StereoGeometry
from phone_host.output.atomic import write_bytes
from phone_host.output.scale_bar import Tick, ticks, with_scale
from phone_host.output.strips import strips

# Viridis: lightness rises evenly, it works in grey prints and for colour-blind readers, and its dark end (68, 1, 84)
# differs from the black that means "none" (Smith and van der Walt, 2015).
_COLOUR_MAP: Final = cv2.COLORMAP_VIRIDIS
_LEVELS: Final = 255  # level 0 means none
_SAMPLES: Final = 50_000  # give the same percentiles as all pixels to within one colour level
# Single wrong matches at the ends must not use up the colours.
_LOW_PERCENT, _HIGH_PERCENT = 1.0, 99.0
_LEAST_DEPTH_SHARE: Final = 0.02  # of the depth: on a flat wall, noise must not become colours


def colour_range_px(disparity: Disparity) -> tuple[float, float]:
    """Return the disparities to show as darkest and brightest: the 1st and 99th percentile.

    Args:
        disparity: (H, W) float32, px, NaN = none.

    Returns:
        Low and high, px; (0, 1) if there is no value at all.
    """
    values = _sample(disparity)
    if values.size == 0:
        return 0.0, 1.0
    low, high = np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT))
    return float(low), float(max(high, low + 1.0))  # in a flat scene, noise must not become colours


def depth_range_m(depth: NDArray[np.float32]) -> tuple[float, float]:
    """Return the depths to show as brightest and darkest: the 1st and 99th percentile.

    Args:
        depth: (H, W) float32, m, NaN = none.

    Returns:
        Near and far, m; (1, 2) if there is no value at all.
    """
    values = _sample(depth)
    if values.size == 0:
        return 1.0, 2.0
    near, far = np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT))
    return float(near), float(max(far, near * (1 + _LEAST_DEPTH_SHARE)))


def colour_disparity(disparity: Disparity, low_px: float, high_px: float) -> Image:
    """Colour a disparity map.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        low_px: disparity of the darkest colour.
        high_px: disparity of the brightest colour, above `low_px`.

    Returns:
        (H, W, 3) BGR; black where there is no value.
    """
    return _coloured(disparity, low_px, high_px)


def disparity_picture(disparity: Disparity, geometry: StereoGeometry | None = None) -> Image:
    """Colour a disparity map and add its scale.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        geometry: its scale is in metres; None: in px.

    Returns:
        (H, W + scale, 3) BGR; without any value black and without a scale.
    """
    low_px, high_px = colour_range_px(disparity)
    image = _coloured(disparity, low_px, high_px)
    if not np.isfinite(disparity).any():
        return image
    span_px = high_px - low_px
    if geometry is None:

        def in_px(pitch: float) -> tuple[Tick, ...]:
            return ticks(low_px, high_px, lambda d: (d - low_px) / span_px, pitch)

        return with_scale(image, _scale_colours(), in_px, "px")
    product, doffs_px = geometry.focal_px * geometry.baseline_m, geometry.doffs_px

    def in_metres(pitch: float) -> tuple[Tick, ...]:
        if high_px + doffs_px <= 0:  # everything is behind infinity
            return ()
        far_m = product / (low_px + doffs_px) if low_px + doffs_px > 0 else float("inf")
        near_m = product / (high_px + doffs_px)
        return ticks(near_m, far_m, lambda z: (product / z - doffs_px - low_px) / span_px, pitch)

    return with_scale(image, _scale_colours(), in_metres, "m")


def depth_picture(cloud: CloudImage) -> Image:
    """Colour the depths of a cloud in even steps of 1 / Z, and add a scale in metres.

    Specks far behind the scene would use up the colours of a scale with even steps of Z.

    Args:
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.

    Returns:
        (H, W + scale, 3) BGR; without any depth black and without a scale.
    """
    depth = cloud[..., 2]
    with np.errstate(divide="ignore"):
        nearness = np.reciprocal(depth)
    near_m, far_m = depth_range_m(depth)
    low, high = 1 / far_m, 1 / near_m
    image = _coloured(np.where(np.isfinite(depth), nearness, np.float32(np.nan)), low, high)
    if not np.isfinite(depth).any():
        return image

    def in_metres(pitch: float) -> tuple[Tick, ...]:
        return ticks(near_m, far_m, lambda z: (1 / z - low) / (high - low), pitch)

    return with_scale(image, _scale_colours(), in_metres, "m")


def write_png(path: Path, image: Image) -> None:
    """Write an image as PNG, whole or not at all.

    Args:
        path: the file.
        image: (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        OSError: the file cannot be written.
    """
    # Level 1 takes a third of the default's time for a few per cent more bytes; these files are viewed once.
    encoded = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    write_bytes(path, encoded.data)


def _sample(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the finite ones of a regular sample of the pixels."""
    step = max(1, int((values.size / _SAMPLES) ** 0.5))
    sample = values[::step, ::step]
    return sample[np.isfinite(sample)]


def _coloured(values: NDArray[np.float32], dark: float, bright: float) -> Image:
    """Colour values from `dark` to `bright`, whichever is greater; NaN becomes black."""
    image = np.empty((*values.shape, 3), dtype=np.uint8)
    table, scale = _table(), np.float32((_LEVELS - 1) / (bright - dark))
    for rows in strips(*values.shape):
        levels = values[rows] - np.float32(dark)
        levels *= scale
        levels += np.float32(1.5)  # to the nearest level, from 1
        np.clip(levels, 1, _LEVELS, out=levels)
        levels[~np.isfinite(values[rows])] = 0
        image[rows] = cv2.applyColorMap(levels.astype(np.uint8), table)
    return image


def _table() -> Image:
    """Return (256, 1, 3) BGR: black, then 255 colours from dark to bright."""
    grey = np.linspace(0, 255, _LEVELS).round().astype(np.uint8)
    colours = cv2.applyColorMap(grey[:, np.newaxis], _COLOUR_MAP)
    return np.concatenate((np.zeros((1, 1, 3), np.uint8), colours))


def _scale_colours() -> Image:
    """Return (255, 3) BGR, from dark to bright."""
    colours: Image = _table()[1:, 0]
    return colours
