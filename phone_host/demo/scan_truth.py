"""Compares a scanned surface with the true one: how far off it is, and how much of the truth it covers. Pure."""

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.mesh import Mesh
from phone_host.scan.scan_model import ScanModel
from phone_host.scene.solid import Solid

_COVERED_M: Final = 0.002
"""True surface with a point of the model so near is covered: somewhat more than the distance of the model's points."""

_SPACING_M: Final = 0.001
_STANDS_M: Final = 0.0005
"""What lies lower than this stands on the mat, and no camera sees it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelErrors:
    """A model against the truth; NaN: there is no model.

    Attributes:
        points: of the model, where some view saw the surface; only these are compared.
        mean_mm: mean distance of its points from the true surface.
        median_mm: their median distance.
        p95_mm: the 95th percentile.
        coverage: share of the true surface, but for what it stands on, with the model within 2 mm.
        volume_percent: how much larger the model's volume is; negative: smaller; NaN: the model is open.
    """

    points: int
    mean_mm: float
    median_mm: float
    p95_mm: float
    coverage: float
    volume_percent: float

    @property
    def sentence(self) -> str:
        """In words."""
        volume = "" if math.isnan(self.volume_percent) else f"; its volume is off by {self.volume_percent:+.1f} %"
        return (
            f"against the true surface: {self.mean_mm:.2f} mm off on average, 95 % of it within {self.p95_mm:.2f} mm,"
            f" {self.coverage * 100:.0f} % of what does not stand on the mat is there{volume}"
        )


def model_errors(model: ScanModel, solid: Solid) -> ModelErrors:
    """Compare a model with the truth.

    Args:
        model: in the axes of the solid.
        solid: the truth.
    """
    used = np.unique(model.mesh.triangles)
    points = model.mesh.points_m[used[model.seen[used]]].astype(np.float64)
    nan = math.nan
    if not len(points):
        return ModelErrors(points=0, mean_mm=nan, median_mm=nan, p95_mm=nan, coverage=0.0, volume_percent=nan)
    volume_m3 = _volume_m3(model.mesh) if model.is_closed else nan
    off_mm = np.abs(solid.signed_distance(points)) * 1000.0
    truth = solid.surface(_SPACING_M)
    truth = truth.where(truth.points[2] > _STANDS_M)
    covered = _near(truth.points.T, points)
    return ModelErrors(
        points=len(points),
        mean_mm=float(off_mm.mean()),
        median_mm=float(np.median(off_mm)),
        p95_mm=float(np.percentile(off_mm, 95)),
        coverage=float(truth.areas_m2[covered].sum() / truth.areas_m2.sum()),
        volume_percent=100.0 * (volume_m3 / solid.volume_m3(_SPACING_M) - 1.0),
    )


def _volume_m3(mesh: Mesh) -> float:
    """Return the volume of a closed mesh: the sum of the tetrahedra between its triangles and the origin."""
    a, b, c = (mesh.points_m[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def _near(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points (N, 3) have one of the others (M, 3) within the distance that counts as covered.

    All are put into cells as wide as that distance, so only the cells beside a point's own can hold what is near.
    """
    low = np.minimum(points.min(axis=0), others.min(axis=0)) - 2 * _COVERED_M
    cells = np.floor((others - low) / _COVERED_M).astype(np.int64)
    own = np.floor((points - low) / _COVERED_M).astype(np.int64)
    size = np.maximum(cells.max(axis=0), own.max(axis=0)) + 2
    factors = np.array([size[1] * size[2], size[2], 1])
    keys = cells @ factors
    order = np.argsort(keys, kind="stable")
    keys, others = keys[order], others[order]
    near = np.zeros(len(points), dtype=np.bool_)
    for step in itertools.product((-1, 0, 1), repeat=3):
        wanted = (own + step) @ factors
        first, end = np.searchsorted(keys, wanted), np.searchsorted(keys, wanted, side="right")
        for shift in range(int((end - first).max(initial=0))):
            left = np.flatnonzero(~near & (first + shift < end))
            apart = points[left] - others[first[left] + shift]
            near[left] |= (apart**2).sum(axis=1) <= _COVERED_M**2
    return near
