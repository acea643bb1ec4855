"""Fits the right camera's turn and focal length to the rows of many features, and tells how well they are known. Pure.

- Robust: Tukey's weights; a wrong match or a thing that moved between the two exposures counts nothing.
- Late images: what moves lies beside its row by its speed times the time between the exposures. That time is estimated as
  well, so that it is not taken for a turn; and whatever moves counts for less, by what its stamp and its speed may be off,
  which all features of one thing share.
- Honest: a lens model is never perfect, and what it leaves differs from place to place but not from pair to pair. So all
  features of one cell of the image together know its rows no better than `MODEL_PX`, however many there are.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.calibration.running.rows import PARAMETERS, RowModel, Sighting, Vector

CELLS: Final = (6, 4)
"""The image is cut into 6 x 4 cells."""

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


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What some sightings together say.

    Attributes:
        values: (4,) parameters as `rows` has them, then the lateness of the left image, s: (5,).
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
    """Fit the parameters to all features of some sightings.

    Args:
        model: of the rig.
        sightings: of one camera position or of several.
    """
    slopes = np.concatenate([seen.slopes for seen in sightings])
    off_px = np.concatenate([seen.off_px for seen in sightings])
    speed = np.nan_to_num(np.concatenate([seen.speed_px_s for seen in sightings]))
    late_s = np.concatenate([np.full(len(seen.off_px), seen.late_s) for seen in sightings])
    # A feature that moves down by v px/s is farther down in the image that was exposed later.
    target = off_px + speed * late_s
    design = np.column_stack([np.concatenate([seen.columns for seen in sightings]), -speed])
    cell, alike_px2 = _cells(model, slopes), MODEL_PX**2 + (speed * _STAMP_S) ** 2
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
    return Fit(
        values=values,
        covariance=np.asarray(np.linalg.inv(matrix), np.float64),
        features=int(counts.sum()),
        share=float(counts.mean()) if len(counts) else 0.0,
        cells=int((np.bincount(cell[counts], minlength=1) >= 2).sum()),
        speed_px_s=float(np.percentile(np.abs(speed[counts]), 90)) if counts.any() else 0.0,
    )


def _cells(model: RowModel, slopes: Vector) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the number of each feature's cell."""
    made, geometry = model.rectification, model.rectification.geometry
    places = slopes * geometry.focal_px + np.array([geometry.cx_px, geometry.cy_px])
    share = (places + 0.5) / np.array([made.width_px, made.height_px])
    column, row = np.clip(share * np.array(CELLS), 0, np.array(CELLS) - 1).astype(np.intp).T
    return np.asarray(row * CELLS[0] + column, np.intp)


def proven(fit: Fit, sigmas: float) -> Vector:
    """Return the parameters of a fit, (4,), with those at 0 that the features do not prove, and the others fitted without them.

    Args:
        fit: as `fit_rows` gives it.
        sigmas: what proves a parameter.
    """
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
