"""Fits the right camera's turn and focal length to the rows of many features, and tells how well they are known. Pure.

- Robust: Tukey's weights; a wrong match or a thing that moved between the two exposures counts nothing.
- Late images: moving objects are off their row by their speed times the time between the exposures. That time is estimated as
  well, so that it is not taken for a turn; and whatever moves counts for less, by what its stamp and its speed may be off,
  which all features of one thing share.
- Honest: a lens model is never perfect, and what it leaves differs from place to place but not from pair to pair. So all
  features of one cell of the image together know its rows no better than `MODEL_PX`, however many there are.

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

import math
from collections.abc import Iterator, Sequence
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


CELLS: Final = (6, 4)
"""The image is cut into 6 x 4 cells."""

_FEWEST: Final = 3
"""A cell's median speaks for it from so many features on."""

Cells = NDArray[np.intp]
"""(N,) number of each feature's cell."""


def cells_of(model: RowModel, slopes: Points) -> Cells:
    """Return the number of each feature's cell, from the slopes (N, 2) of points of the right image."""
    made, geometry = model.rectification, model.rectification.geometry
    places = slopes * geometry.focal_px + np.array([geometry.cx_px, geometry.cy_px])
    share = (places + 0.5) / np.array([made.width_px, made.height_px])
    column, row = np.clip(share * np.array(CELLS), 0, np.array(CELLS) - 1).astype(np.intp).T
    return np.asarray(row * CELLS[0] + column, np.intp)


def medians(cell: Cells, values: Vector) -> Iterator[tuple[NDArray[np.bool_], float]]:
    """Yield which features lie in a cell and the median of their values (N,), for each cell that has enough of them."""
    for number in np.unique(cell):
        here = cell == number
        if here.sum() >= _FEWEST:
            yield here, float(np.median(values[here]))


def typical_px(cell: Cells, off_px: Vector) -> float:
    """Return how far features lie beside their rows: the mean over all cells of their medians of `off_px` (N,), px; 0 without features."""
    found = [abs(median_px) for _, median_px in medians(cell, off_px)]
    return float(np.mean(found)) if found else 0.0


MODEL_PX: Final = 0.1
"""What good calibrations leave in their own images, and what differs from one part of a scene to another: euroc 0.11 to 0.13 px."""

_LEAST_PX: Final = 0.1
"""Followed features of good images scatter by this."""

_PRIOR: Final = np.array([math.radians(2.0)] * 3 + [0.05, 0.05])
"""Turns, focal length, lateness (s): no more than this. It keeps finite what the features do not tell."""

_STAMP_S: Final = 0.004
"""By this a feature's speed counts as doubt of its row: exposures are stamped to some ms, and rows of a rolling shutter differ as much."""

_TUKEY: Final = 4.7
_ROUNDS: Final = 12
_ROUNDS_OF_HUBER: Final = 3
_COUNTS: Final = 0.3
"""A feature counts if it is trusted by so much."""

_SIGMA_OF_MEDIAN: Final = 1.48

_MOST_OF_CELL: Final = 9.0
"""Beyond three sigmas one cell, of wrong matches perhaps, says no more."""

_LINEAR: Final = 0.1
"""The rows of a turn by 10 degrees differ by this share from the linear model's."""

_BETTER: Final = 0.8
"""What is proven must take away a fifth of the distance from the rows. Turns read from the leftovers of given rigs' lenses, whose
uncertainty called them proven (up to 5 sigmas), took away 0 to 9 %; turned cameras' take away nearly all."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What some sightings together say.

    Attributes:
        values: (4,) parameters in the order of the columns of `Rows`, then the lateness of the left image, s: (5,).
        covariance: (5, 5).
        features: how many count.
        share: of all features.
        cells: cells of the image that hold two that count.
        speed_px_s: how fast the fastest tenth of those that count moves across the lines; 0 if that is not known.
    """

    values: Vector
    covariance: Vector
    features: int
    share: float
    cells: int
    speed_px_s: float

    def rows_sigma_px(self, everywhere: Vector) -> float:
        """Return how well the rows of the whole image are known, root mean square, px."""
        inner = self.covariance[:PARAMETERS, :PARAMETERS]
        return math.sqrt(float(np.einsum("ni,ij,nj->n", everywhere, inner, everywhere).mean()))


def fit_rows(model: RowModel, sightings: Sequence[Sighting]) -> Fit:
    """Fit the parameters to all features of some sightings, of one camera position or of several."""
    slopes = np.concatenate([seen.slopes for seen in sightings])
    off_px = np.concatenate([seen.off_px for seen in sightings])
    speed = np.nan_to_num(np.concatenate([seen.speed_px_s for seen in sightings]))
    late_s = np.concatenate([np.full(len(seen.off_px), seen.late_s) for seen in sightings])
    # A feature that moves down by v px/s is farther down in the image that was exposed later.
    target = off_px + speed * late_s
    design = np.column_stack([np.concatenate([seen.columns for seen in sightings]), -speed])
    cell, alike_px2 = cells_of(model, slopes), MODEL_PX**2 + (speed * _STAMP_S) ** 2
    values, weights = np.zeros(PARAMETERS + 1), np.ones(len(target))
    trust = weights
    matrix = np.diag(_PRIOR**-2.0)
    for number in range(_ROUNDS):
        rest = np.abs(target - design @ values) if number else np.zeros(len(target))
        counted = rest[weights > 0] if number else rest[:0]
        scale = max(_SIGMA_OF_MEDIAN * float(np.median(counted)), _LEAST_PX) if counted.size else _LEAST_PX
        spread = np.hypot(scale, speed * _STAMP_S)
        # Huber's weights first: Tukey's would hold on to whatever they begin with.
        trust = 1 / np.maximum(rest / spread, 1.0)
        if number >= _ROUNDS_OF_HUBER:
            trust = np.clip(1 - (rest / (_TUKEY * spread)) ** 2, 0, None) ** 2
        weights = trust / spread**2
        weights = weights / (1 + alike_px2 * np.bincount(cell, weights)[cell])
        matrix = np.diag(_PRIOR**-2.0) + design.T @ (weights[:, np.newaxis] * design)
        values = np.linalg.solve(matrix, design.T @ (weights * target))
    counts = trust > _COUNTS
    told_px = design @ values
    covariance = np.linalg.inv(matrix) * _disagreement(cell, alike_px2 + (_LINEAR * told_px) ** 2, target - told_px)
    return Fit(
        values=values,
        covariance=np.asarray(covariance, np.float64),
        features=int(counts.sum()),
        share=float(counts.mean()) if len(counts) else 0.0,
        cells=int((np.bincount(cell[counts], minlength=1) >= 2).sum()),
        speed_px_s=float(np.percentile(np.abs(speed[counts]), 90)) if counts.any() else 0.0,
    )


def _disagreement(cell: Cells, variance_px2: Vector, rest_px: Vector) -> float:
    """Return by how much cells contradict what was fitted to them all, as a factor of its variance (Birge's ratio): 1 if they agree.

    All features speak, those that count and those that were taken for wrong: cells of a rig that has turned agree on the
    turn. If a lens is modelled badly, some corners say so and others the contrary.
    """
    found = [
        min(median_px**2 / (float(variance_px2[here].mean()) + _LEAST_PX**2 / int(here.sum())), _MOST_OF_CELL)
        for here, median_px in medians(cell, rest_px)
    ]
    return max(1.0, sum(found) / max(len(found) - PARAMETERS, 1))


def is_better(model: RowModel, sightings: Sequence[Sighting], sigmas: float) -> bool:
    """Tell whether what half of the sightings prove brings the other half's features nearer to their rows, and the reverse.

    Uncertainties are computed from what is assumed of lenses; this assumes nothing. A turn that is none follows some
    corners of the image and spoils others.
    """
    before_px = after_px = 0.0
    halves = sightings[::2], sightings[1::2]
    for fitted, judged in (halves, halves[::-1]):
        values = proven(fit_rows(model, fitted), sigmas)
        off_px = np.concatenate([seen.off_px for seen in judged])
        rest_px = off_px - np.concatenate([seen.columns for seen in judged]) @ values
        cell = cells_of(model, np.concatenate([seen.slopes for seen in judged]))
        before_px += typical_px(cell, off_px)
        after_px += typical_px(cell, rest_px)
    return after_px <= _BETTER * before_px


def proven(fit: Fit, sigmas: float) -> Vector:
    """Return the parameters of a fit, (4,), with those at 0 that the features do not prove by so many sigmas, and the others fitted without them."""
    kept = list(range(PARAMETERS))
    while kept:
        information = np.linalg.inv(fit.covariance[:PARAMETERS, :PARAMETERS])
        right = (information @ fit.values[:PARAMETERS])[kept]
        inner = information[np.ix_(kept, kept)]
        found, sigma = np.linalg.solve(inner, right), np.sqrt(np.diag(np.linalg.inv(inner)))
        weakest = int(np.argmin(np.abs(found) / sigma))
        if abs(found[weakest]) >= sigmas * sigma[weakest]:
            values = np.zeros(PARAMETERS)
            values[kept] = found
            return values
        del kept[weakest]
    return np.zeros(PARAMETERS)
