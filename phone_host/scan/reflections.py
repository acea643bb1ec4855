"""Depths left out where a lamp may be reflected: both cameras see its image, which lies behind the surface. Pure.

What is reflected comes on top of a surface's own light, and lies elsewhere for each camera: it is bright, and the matcher is not sure of it.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.scan.view import Depth, View

_BRIGHT_PERCENT: Final = 80.0
"""Of a thing's pixels so many are darker. What is bright of its own, and sure, stays."""

_RIM_PX: Final = 5
_SURE: Final = 128
"""Confidence, of 255: surer depths of a shiny thing are off by more than a pixel at most three times in a hundred, less sure ones eight times and more."""


def without_reflections(view: View, wanted: Depth) -> View:
    """Leave out the depths of a thing that are bright and unsure.

    Args:
        view: with the matcher's confidence; one without stays as it is.
        wanted: (H, W) its depths that show the thing, NaN elsewhere.
    """
    is_thing = np.isfinite(wanted)
    if view.confidence is None or not is_thing.any():
        return view
    blue, green, red = cv2.split(view.colours)
    darkest = np.minimum(np.minimum(blue, green), red)  # a lamp's light is white, whatever the colour of the thing
    is_bright = darkest > np.percentile(darkest[is_thing], _BRIGHT_PERCENT)
    around = cv2.dilate(is_bright.astype(np.uint8), np.ones((_RIM_PX, _RIM_PX), np.uint8)) > 0
    is_out = is_thing & around & (view.confidence < _SURE)
    return view.masked(~is_out)
