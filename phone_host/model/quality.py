"""What is measured on a flat wall or board that the cameras look at; what becomes of surface that no view measured. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model.images import Crop

UNSEEN_HELP: Final = "surface that no view measured: fill it in with colours from its border, fill it in pink, or cut it, which leaves the surface open"


class UnseenSurface(Enum):
    """The values of `--unseen`.

    Attributes:
        FILL: it is there, with colours from the border of the surface that was measured.
        PINK: it is there, in pink.
        CUT: it is not there; the surface is open.
    """

    FILL = "fill"
    PINK = "pink"
    CUT = "cut"


Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityPlane:
    """A plane in space as a rectified pair sees it: d(x, y) = slope_x * x + slope_y * y + at_origin_px.

    Attributes:
        slope_x: change of the disparity per column, px/px.
        slope_y: the same per row.
        at_origin_px: disparity at pixel (0, 0), px.
    """

    slope_x: float
    slope_y: float
    at_origin_px: float


class Seen(Enum):
    """What the cameras saw where a plane was expected.

    PLANE: a plane; the figures hold.
    TOO_FEW: too few pixels have a disparity.
    OFF_PLANE: too many disparities lie far off every plane: several surfaces, or something in front of one.
    ENDLESS: a plane that reaches infinity inside the region, as a floor does at the horizon.
    BENT: neighbouring disparities deviate together: a curved surface, several ones, or a wrong lens model.
    SCATTERED: disparities deviate by more than matching leaves on any textured surface, each on its own.
    """

    PLANE = "plane"
    TOO_FEW = "too_few"
    OFF_PLANE = "off_plane"
    ENDLESS = "endless"
    BENT = "bent"
    SCATTERED = "scattered"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tiles:
    """The figures over the image, in a grid. Arrays are (rows, columns) float64, NaN = not measured.

    Attributes:
        area: what the grid covers, px of the rectified left image.
        fill: share of a tile's pixels that have a disparity.
        scatter_px: RMS of a tile's disparities about the tile's own median offset, px.
        offset_px: median distance of a tile's disparities from the fitted plane, px; above 0 is nearer.
        offset_m: median depth error of a tile against the reference, or against the fitted plane without one, m; above 0
            is too far.
        offset_share: the same as a share of the depth.
    """

    area: Crop
    fill: Values
    scatter_px: Values
    offset_px: Values
    offset_m: Values
    offset_share: Values


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlaneQuality:
    """The figures of one pair. Without a plane (`seen`) those that could not be computed are NaN.

    Attributes:
        seen: whether it was a plane.
        roi: bounding box of the pixels that count, px of the rectified left image.
        pixels: how many count.
        fill: share of them that have a disparity: the fill rate.
        off_plane: share of these disparities that are wrong matches: so far off the plane that no figure counts them.
        plane: that was fitted.
        subpixel_rms_px: RMS distance of the disparities from the plane, px.
        rms_m: RMS distance of the depths from the plane, along the rectified optical axis, m.
        bend_px: RMS of the mean distances in a coarse grid, less what noise alone gives: how much neighbours deviate together, px.
        distance_m: from the left camera to the plane, m: along its own optical axis with a stated distance, else the depth at
            the middle of the pixels that count or of the board.
        perpendicular_m: shortest distance to the plane, m.
        tilt_deg: angle between the plane's normal and the rectified optical axis, degrees.
        bias_m: `distance_m` minus the true distance, m; NaN: none is known.
        true_m: the true distance, m; NaN: none is known.
        tiles: the same over the image.
    """

    seen: Seen
    roi: Crop
    pixels: int
    fill: float
    off_plane: float
    plane: DisparityPlane
    subpixel_rms_px: float
    rms_m: float
    bend_px: float
    distance_m: float
    perpendicular_m: float
    tilt_deg: float
    bias_m: float
    true_m: float
    tiles: Tiles

    @property
    def rms_share(self) -> float:
        """Plane-fit RMS as a share of the distance."""
        return self.rms_m / self.distance_m

    @property
    def bias_share(self) -> float:
        """Bias as a share of the true distance: the Z accuracy; NaN without one."""
        return self.bias_m / self.true_m
