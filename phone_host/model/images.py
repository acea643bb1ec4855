"""A rectified pair of images, and what a matcher finds in it: depth, how certain each value is, what it corrected first. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
"""(H, W) grey or (H, W, 3) BGR, dtype uint8."""

Disparity = NDArray[np.float32]
"""(H, W) float32, px, left x - right x, NaN = none."""

CloudImage = NDArray[np.float32]
"""(H, W, 3) float32, metres: X, Y, Z of each left pixel in the left camera's axes, NaN = none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoGeometry:
    """Converts the disparity of a rectified pair to metres: z = focal_px * baseline_m / (disparity + doffs_px).

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Crop:
    """A rectangle of the rectified left image. Only its pixels get a depth.

    Attributes:
        x_px: its first column, px.
        y_px: its first row, px.
        width_px: its width, px.
        height_px: its height, px.
    """

    x_px: int
    y_px: int
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthLimits:
    """Between which depths a point is kept, and how certain its disparity is.

    Attributes:
        near_m: nearer points are cut, m; 0: none.
        far_m: points are cut that have a coordinate beyond it, m.
        disparity_error_px: the error of a disparity from which `far_m` and every depth's uncertainty follow, px of the
            rectified images.
        from_rig: whether `far_m` follows from the rig; else the user gave it.
    """

    near_m: float
    far_m: float
    disparity_error_px: float
    from_rig: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CutCounts:
    """What became of a rectified left image's pixels. The six counts add up to all of them.

    Attributes:
        kept: have a point.
        unmatched: the matcher found no disparity.
        at_zero: their disparity is not above the noise of zero, so it is no measurement.
        too_far: beyond the far limit.
        too_near: nearer than the near limit.
        outside: outside the crop.
    """

    kept: int = 0
    unmatched: int = 0
    at_zero: int = 0
    too_far: int = 0
    too_near: int = 0
    outside: int = 0

    @property
    def inside(self) -> int:
        """Number of pixels inside the crop; all, without one."""
        return self.kept + self.unmatched + self.at_zero + self.too_far + self.too_near

    def __add__(self, other: "CutCounts") -> "CutCounts":
        """Return the counts of both."""
        return CutCounts(**{name: getattr(self, name) + getattr(other, name) for name in self.__slots__})


class Epipolar(Enum):
    """Where a point of the left image lies in the rectified right one, d px away: which way the epipolar lines run.

    LEFT: on the same row, at (x - d, y). The right camera stands to the right of the left one, as is usual.
    UP: in the same column, at (x, y - d). The "right" camera stands below the left one.
    DOWN: in the same column, at (x, y + d). The "right" camera stands above the left one.
    """

    LEFT = "left"
    UP = "up"
    DOWN = "down"

    @property
    def is_vertical(self) -> bool:
        """Whether the epipolar lines are columns: the cameras stand one above the other."""
        return self is not Epipolar.LEFT

    @property
    def way(self) -> tuple[int, int]:
        """Where a point lies in the right image: this many disparities right and down of its place in the left one."""
        match self:
            case Epipolar.LEFT:
                return -1, 0
            case Epipolar.UP:
                return 0, -1
            case Epipolar.DOWN:
                return 0, 1
            case _:
                assert_never(self)


@dataclass(frozen=True, slots=True)
class RectifiedPair:
    """Two images of equal size whose epipolar lines are their rows: a point at (x, y) left lies at (x - d, y) right.

    Attributes:
        left: of the reference camera.
        right: the same size.
        epipolar: other than LEFT if the cameras stand one above the other; then the lines are columns.
    """

    left: Image
    right: Image
    epipolar: Epipolar = Epipolar.LEFT


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """How a pair was matched.

    Attributes:
        scale: size of the images that were matched, as a share of the rectified ones', in (0, 1].
        disparities: N, px of the rectified images: 0 <= d < N was searched; 0: the matcher's own range, not known here.
    """

    scale: float = 1.0
    disparities: int = 0


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
