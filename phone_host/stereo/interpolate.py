"""An image of a moment at which its camera took none, from the two images around it or before it, by dense optical flow. Pure.

The later image is bent along the motion that leads from the earlier one to it: back to a moment between the two, or on to one after both, as if
everything went on at the same speed. What the later image does not show cannot appear; beside moving things that leaves a rim.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.model import Image

_ROUNDS: Final = 2
"""The motion is known where things are in the later image, and wanted where they are in the new one: a fixed point, close after two rounds."""

_LEAST_PX: Final = 16
"""The flow refuses smaller images; they come back as they are."""

LARGEST_PART: Final = 1.0
"""Farther than the time between the two images nothing is guessed."""


class Interpolator:
    """Bends images in time; keeps the flow's working memory."""

    def __init__(self) -> None:
        # Of the flows in OpenCV's main modules the one with the best ratio of error to time (Kroeger et al., 2016).
        self._flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)

    def back(self, earlier: Image, later: Image, part: float) -> Image:
        """Make the image of a moment.

        Args:
            earlier: (H, W) or (H, W, 3), uint8.
            later: of the same shape, taken after it.
            part: how far before `later` the moment lies, in times between the two images: 1 is at `earlier`, below 0 is after `later`.

        Returns:
            The image, of the same shape.
        """
        if part == 0.0 or min(later.shape[:2]) < _LEAST_PX:
            return later
        greys = [image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (later, earlier)]
        flow = np.asarray(self._flow.calc(greys[0], greys[1], np.empty(0, np.float32)), dtype=np.float32)
        height, width = later.shape[:2]
        x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
        at_x, at_y = x, y
        for _ in range(_ROUNDS):
            moved = np.asarray(cv2.remap(flow, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
            at_x, at_y = x - np.float32(part) * moved[..., 0], y - np.float32(part) * moved[..., 1]
        bent = cv2.remap(later, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(bent, dtype=np.uint8)
