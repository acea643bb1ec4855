"""What a matcher gives beside the disparity: how certain each value is, and what it corrected first. No behaviour, no I/O."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.model.images import Disparity

Confidence = NDArray[np.uint8]
"""(H, W) uint8: 0 = no value, 255 = most certain. It orders the values of one pair; it is no probability."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchReport:
    """What a matcher found to be different between the two images and corrected before it matched them.

    Attributes:
        vertical_px: how far too low the right image lay, px; negative: too high. Of cameras that stand one above the
            other: how far beside its column, px.
        gain: the right image's levels were multiplied by this, in the middle of the image.
        offset_levels: then this was added to them, grey levels of 0 .. 255. Gain 1 and offset 0: nothing was corrected.
        vignetting_percent: how much more they were multiplied by at the corners than in the middle, on average, percent;
            positive: the right image was darker there.
        shading_percent: by how much the factors of opposite edges differ, where they differ most, percent: a lamp at one side.
        confidence_histogram: number of pixels with a value by their confidence, in classes of equal width over 1 .. 255;
            None if the matcher has no confidence.
    """

    vertical_px: float = 0.0
    gain: float = 1.0
    offset_levels: float = 0.0
    vignetting_percent: float = 0.0
    shading_percent: float = 0.0
    confidence_histogram: tuple[int, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Matched:
    """A matched pair.

    Attributes:
        disparity: px of the left image, NaN = none.
        confidence: the same size; None if the matcher has none.
        report: what was corrected.
    """

    disparity: Disparity
    confidence: Confidence | None = None
    report: MatchReport = MatchReport()  # frozen
