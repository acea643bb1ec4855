"""Shows disparity as a picture: near is bright, far is dark, no value is black."""

from pathlib import Path

import cv2
import numpy as np

from phone_host.model import Disparity, Image
from phone_host.output.atomic import write_bytes

# Viridis: lightness rises evenly, it works in grey prints and for colour-blind readers, and its dark end (68, 1, 84)
# differs from the black that means "none" (Smith and van der Walt, 2015).
_COLOUR_MAP = cv2.COLORMAP_VIRIDIS
_SAMPLE_STEP = 3  # a ninth of the pixels gives the same percentiles to within one colour level, in a ninth of the time
# Single wrong matches at the ends must not use up the colours.
_LOW_PERCENT, _HIGH_PERCENT = 1.0, 99.0


def colour_range_px(disparity: Disparity) -> tuple[float, float]:
    """Return the disparities to show as darkest and brightest: the 1st and 99th percentile.

    Args:
        disparity: (H, W) float32, px, NaN = none.

    Returns:
        Low and high, px; (0, 1) if there is no value at all.
    """
    sample = disparity[::_SAMPLE_STEP, ::_SAMPLE_STEP]
    values = sample[np.isfinite(sample)]
    if values.size == 0:
        return 0.0, 1.0
    low, high = np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT))
    return float(low), float(max(high, low + 1.0))  # in a flat scene, noise must not become colours


def colour_disparity(disparity: Disparity, low_px: float, high_px: float) -> Image:
    """Colour a disparity map.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        low_px: disparity of the darkest colour.
        high_px: disparity of the brightest colour, above `low_px`.

    Returns:
        (H, W, 3) BGR; black where there is no value.
    """
    valid = np.isfinite(disparity)
    scaled = (np.where(valid, disparity, low_px) - low_px) * (255.0 / (high_px - low_px))
    levels = np.clip(np.rint(scaled), 0, 255).astype(np.uint8)
    colours = np.asarray(cv2.applyColorMap(levels, _COLOUR_MAP), dtype=np.uint8)
    colours[~valid] = 0
    return colours


def write_preview(path: Path, disparity: Disparity) -> None:
    """Write a disparity map as a coloured PNG.

    Args:
        path: the file; it appears whole or not at all.
        disparity: (H, W) float32, px, NaN = none.

    Raises:
        OSError: the file cannot be written.
    """
    write_png(path, colour_disparity(disparity, *colour_range_px(disparity)))


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
    write_bytes(path, encoded.tobytes())
