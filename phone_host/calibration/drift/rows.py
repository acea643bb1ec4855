"""How a turned right camera, or another focal length of it, moves its points off their rows. Pure.

A point of the calibrated rig lies on one row in both rectified images. If the right camera turns by a small vector t in its
own axes, the direction q = (x, y, 1) of a point in the rectified right image becomes q + u x q with u = R_right t; if its
focal length grows by s, the point moves away from the camera's axis by s. So the row of a point at the slopes x, y is off by

    f (-u_x (1 + y^2) + u_y x y + u_z x + s (y - y0))

where distortion makes the last term up to a tenth more at the edge. Pitch moves all rows alike, roll tilts them, a longer
focal length spreads them, and yaw (vergence) twists them: only the corners tell it. That is why yaw is the last to be proven
and the first to be doubted: it moves disparities by f u_y.

The vertical error is told by these four alone. That the right camera moved, as well as turned, shows in proportion to
disparity; a bar that bends by 0.3 degrees moves it by less than 0.1 px of rows, which is left to the scatter.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import AS_CALIBRATED, Departure, Rectification, Rig, Side
from phone_host.stereo.evidence_points import PointMaps, Points, ThroughRig
from phone_host.stereo.evidence_track import Followed

Vector = NDArray[np.float64]

PARAMETERS: Final = 4
"""The turn about the right camera's three axes, rad, and the focal length's factor minus 1."""

_WIDER: Final = 1e-3
"""Step of the numeric derivative by the focal length: a webcam's refocusing is a few of these."""

_P95: Final = 95

_OVER: Final = 9
"""The image's rows are judged at 9 x 9 places."""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """The features of one judged pair, as the calibrated rig would have rectified them.

    Attributes:
        slopes: (N, 2) of the right image's points: x / z and y / z in the rectified axes.
        columns: (N, 4): how far each moves across its line for each parameter, px per rad or per unit.
        off_px: (N,) right minus left across the epipolar lines, px.
        speed_px_s: (N,) how fast each moves across the lines in the left image, px/s; NaN = not measured.
        late_s: by how much later the left image was exposed than the right one, by their stamps, s.
    """

    slopes: Points
    columns: Vector
    off_px: Vector
    speed_px_s: Vector
    late_s: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class RowModel:
    """What moves rows in one rectified size.

    Attributes:
        rig: as it was calibrated, at the size of its images.
        rectification: of it.
    """

    rig: Rig
    rectification: Rectification

    @property
    def axis(self) -> int:
        """The coordinate across the epipolar lines: 1, or 0 if the cameras stand one above the other."""
        return 0 if self.rectification.epipolar.is_vertical else 1

    def columns(self, slopes: Points) -> Vector:
        """Return (N, 4): how far points of the right image, at slopes (N, 2), move across their lines for each parameter, px per rad or per unit."""
        x, y = slopes.T
        one = np.ones(len(slopes))
        about = [-one - y * y, x * y, x] if self.axis == 1 else [-x * y, one + x * x, -y]
        turns = self.rectification.geometry.focal_px * np.column_stack(about) @ self.rectification.R_right
        return np.column_stack([turns, self._spread(slopes)])

    def _spread(self, slopes: Points) -> Vector:
        """Return how far points move across their lines if the focal length grows, px per unit: through the lens, whose bend multiplies it."""
        geometry, maps = self.rectification.geometry, ThroughRig(self.rig, self.rectification)
        places = slopes * geometry.focal_px + np.array([geometry.cx_px, geometry.cy_px])
        middle = self.rig.right.matrix[:2, 2]
        own = maps.own(places, Side.RIGHT)
        wider = maps.rectified(middle + (own - middle) * (1 + _WIDER), Side.RIGHT)
        return np.asarray(np.nan_to_num((wider - places)[:, self.axis]) / _WIDER, np.float64)

    def everywhere(self) -> Vector:
        """Return (81, 4): the columns at places all over the image."""
        made, geometry = self.rectification, self.rectification.geometry
        x, y = (np.linspace(0, length - 1, _OVER) for length in (made.width_px, made.height_px))
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return self.columns((places - np.array([geometry.cx_px, geometry.cy_px])) / geometry.focal_px)

    def rows_px(self, values: Vector) -> float:
        """Return the vertical error that the four parameters make, 95th percentile over the image, px."""
        return float(np.percentile(np.abs(self.everywhere() @ values), _P95))

    def sighting(self, seen: Followed, now: PointMaps, calibrated: PointMaps, late_s: float = 0.0) -> Sighting:
        """Take followed features back to what the calibrated rig would have made of them.

        Args:
            seen: features of rectified images, px of upright images.
            now: how these images were rectified.
            calibrated: how the rig as it was calibrated rectifies them.
            late_s: by how much later the left image was exposed than the right one, by their stamps, s.
        """
        geometry = self.rectification.geometry
        right_px = calibrated.rectified(now.own(seen.right_px, Side.RIGHT), Side.RIGHT)
        off_px = (right_px - seen.left_px)[:, self.axis]
        known = np.isfinite(right_px).all(axis=1)
        moves = np.isfinite(seen.velocity_px_s).all(axis=1)
        if moves.any():  # what could not be followed from the pair before moves fast, or was hidden
            known &= moves
        slopes = (right_px[known] - np.array([geometry.cx_px, geometry.cy_px])) / geometry.focal_px
        return Sighting(slopes, self.columns(slopes), off_px[known], seen.velocity_px_s[known, self.axis], late_s)


def departure_of(values: Vector) -> Departure:
    """Return the correction of the four parameters."""
    if not values.any():
        return AS_CALIBRATED
    x, y, z, spread = values.tolist()
    return Departure(turn_rad=(x, y, z), focal=1.0 + spread)


def values_of(departure: Departure) -> Vector:
    """Return the four parameters of a correction."""
    return np.array([*departure.turn_rad, departure.focal - 1.0])
