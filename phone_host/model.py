"""Types that the host's stages hand to each other. No behaviour, no I/O.

Conventions: camera axes x right, y down, z forward; pixel centres are integers (OpenCV); metres inside; NaN = no measurement.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
"""(H, W) grey or (H, W, 3) BGR, dtype uint8."""

Disparity = NDArray[np.float32]
"""(H, W) float32, px, left x - right x, NaN = none."""

CloudImage = NDArray[np.float32]
"""(H, W, 3) float32, metres: X, Y, Z of each left pixel in the left camera's axes, NaN = none."""


@dataclass(frozen=True, slots=True)
class StereoGeometry:
    """What turns a disparity into metres for a rectified pair: z = focal_px * baseline_m / (disparity + doffs_px).

    Attributes:
        focal_px: focal length of both rectified images, px.
        baseline_m: distance of the two camera centres, m.
        cx_px: x of the left image's principal point, px.
        cy_px: y of both principal points, px.
        doffs_px: x of the right principal point minus that of the left, px (Middlebury's `doffs`).
    """

    focal_px: float
    baseline_m: float
    cx_px: float
    cy_px: float
    doffs_px: float = 0.0


@dataclass(frozen=True, slots=True)
class RectifiedPair:
    """Two images of one size whose epipolar lines are the scanlines: a point at (x, y) left stands at (x - d, y) right."""

    left: Image
    right: Image
