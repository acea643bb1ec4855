"""Interpolates an image at a moment when its camera took none, from the two images around or before it, by dense optical flow. Pure.

The later image is warped along the motion from the earlier one to it: back to a moment between the two, or on to one
after both, as if everything went on at the same speed. What the later image does not show cannot appear; this leaves a
rim beside moving things.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.model import Image

_LEAST_PX: Final = 16
"""The flow refuses smaller images; they are returned unchanged."""

LARGEST_FRACTION: Final = 1.0
"""Nothing is extrapolated farther than the time between the two images."""


class Interpolator:
    """Warps images in time; keeps the flow's working memory."""

    def __init__(self) -> None:
        # Of the flows in OpenCV's main modules, this one has the best ratio of error to time (Kroeger et al., 2016).
        # Its fastest preset leaves the same depth error on moving things as the next one (3.4 mm, test_interpolate) in
        # a seventh of the time.
        self._flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._grid = np.empty((0, 0, 2), dtype=np.float32)

    def back(self, earlier: Image, later: Image, fraction: float) -> Image:
        """Make the image at a given moment.

        Args:
            earlier: (H, W) or (H, W, 3), uint8.
            later: same shape, taken after it.
            fraction: how far before `later` the moment lies, as a share of the time between the two images: 1 is at
                `earlier`, below 0 is after `later`.

        Returns:
            The image, same shape.
        """
        if fraction == 0.0 or min(later.shape[:2]) < _LEAST_PX:
            return later
        greys = [image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (later, earlier)]
        flow = np.asarray(self._flow.calc(greys[0], greys[1], np.empty(0, np.float32)), dtype=np.float32)
        if self._grid.shape[:2] != later.shape[:2]:
            axes = (np.arange(length, dtype=np.float32) for length in later.shape[1::-1])
            self._grid = np.stack(np.meshgrid(*axes), axis=-1)
        # The motion is known at the places of the later image but needed at those of the new one. The error is how much
        # the motion changes over its own length. Looking it up at the new places (a fixed point) made no difference to
        # depth, at four times the cost.
        places = self._grid - np.float32(fraction) * flow
        bent = cv2.remap(later, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload] # stubs know no pair of columns
        return np.asarray(bent, dtype=np.uint8)
