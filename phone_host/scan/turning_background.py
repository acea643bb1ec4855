"""What stands still behind a thing that turns, learnt from all views together. Pure.

Each pixel's background is the grey that comes back most often. In a view, pixels that show it and hang together with the picture's border are
background; those inside of the thing are not, even if it is plain there.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.scan.turning_mask import enclosed
from phone_host.scan.view import Depth, View

Flags = NDArray[np.bool_]

_SAMPLES: Final = 24
"""Views that are compared with each other, spread over all."""

_ALIKE: Final = 8.0
"""Grey levels between two views of the same background, after a blur of 3 px."""

_LEAST_SHARE: Final = 0.25
"""Of the views that must show it: the spots of a turning texture are alike by chance in one of ten."""

_DEPTH_SHARE: Final = 0.015
"""Of the depth, by which two views of the same background differ at most."""

_RIM_PX: Final = 5
"""Across which the background beside the thing may be the thing."""


class Background:
    """What the cameras see where the thing is not.

    Attributes:
        depth_m: (H, W) float32, m, NaN = not known.

    Args:
        greys: (H, W) uint8 of each view.
        depths_m: (H, W) float32 of each, m, NaN = none.
    """

    def __init__(self, greys: Sequence[Image], depths_m: Sequence[Depth]) -> None:
        chosen = np.unique(np.linspace(0, len(greys) - 1, _SAMPLES).round().astype(np.int64))
        stack = np.array([_blurred(greys[at]) for at in chosen])
        depths = np.array([depths_m[at] for at in chosen])
        alike = np.zeros(stack.shape, np.uint8)
        for number in range(len(chosen)):
            alike[number] = (np.abs(stack - stack[number]) <= _ALIKE).sum(axis=0)
        best = alike.argmax(axis=0)[np.newaxis]
        self._grey = np.take_along_axis(stack, best, axis=0)[0]
        self._known = np.take_along_axis(alike, best, axis=0)[0] >= max(_LEAST_SHARE * len(chosen), 3)
        same = np.abs(stack - self._grey) <= _ALIKE
        known = np.isfinite(depths) & same
        # A mean, because medians of so many NaN are slow; what shows the background by chance is cut by `same`.
        count = known.sum(axis=0)
        total = np.where(known, depths, np.float32(0)).sum(axis=0)
        self.depth_m = np.where(self._known & (count > 0), total / np.maximum(count, 1), np.float32(np.nan)).astype(
            np.float32
        )

    def is_seen(self, grey: Image, depth_m: Depth) -> Flags:
        """Return (H, W): which pixels of a view show the background."""
        alike = self._known & (np.abs(_blurred(grey) - self._grey) <= _ALIKE)
        nearer = depth_m < self.depth_m * np.float32(1 - _DEPTH_SHARE)  # False without a depth
        still = cv2.medianBlur((alike & ~nearer).astype(np.uint8), 5) > 0
        return ~enclosed(~still)

    def opened(self, view: View) -> View:
        """Return a view with infinite depths where it shows the background: nothing of the thing is there, however near the table is."""
        still = self.is_seen(view.grey, view.depth_m).astype(np.uint8)
        sure = cv2.erode(still, np.ones((_RIM_PX, _RIM_PX), np.uint8)) > 0
        return replace(view, depth_m=np.where(sure, np.float32(np.inf), view.depth_m))


def _blurred(grey: Image) -> NDArray[np.float32]:
    return np.asarray(cv2.blur(grey, (3, 3)), np.float32)
