"""Whether a model's stated errors hold: how many of its points lie within two standard deviations of the truth, after the best rigid alignment."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.scan_model import ScanModel

Floats = NDArray[np.float64]
Distance = Callable[[Floats], Floats]

_POINTS = 2000
_ALIGNED = 400
_STEPS = 12
_ROBUST_M = 0.003
_FAR_M = 0.01
_NUDGE_M = 1e-5


@dataclass(frozen=True, slots=True)
class Coverage:
    """How stated errors compare with true ones.

    Attributes:
        share: of the points within two stated standard deviations, 0..1.
        width: of the stated deviations, in those that 95 % of the points need.
        stated_m: median of the stated deviations, m.
        rms_m: root mean square of the true errors, m.
    """

    share: float
    width: float
    stated_m: float
    rms_m: float


def coverage(model: ScanModel, distance: Distance, start: SE3 | None, reach_m: float = np.inf) -> Coverage:
    """Compare a model with the truth.

    Args:
        model: its seen points count.
        distance: returns how far points (N, 3), m, lie from the true surface, m.
        start: takes the model's points to the true axes, about; from there it is aligned rigidly. None: it is in the true axes.
        reach_m: points farther from the true vertical axis do not count.

    Returns:
        The comparison; NaN without any such point.
    """
    chosen = np.flatnonzero(model.seen & np.isfinite(model.noise_m))
    chosen = np.random.default_rng(0).permutation(chosen)
    points, sigma = model.mesh.points_m[chosen].astype(np.float64), model.noise_m[chosen].astype(np.float64)
    near = np.linalg.norm((points if start is None else start.apply(points))[:, :2], axis=1) < reach_m
    points, sigma = points[near][:_POINTS], sigma[near][:_POINTS]
    if not len(points):
        return Coverage(np.nan, np.nan, np.nan, np.nan)
    placed = points if start is None else _aligned(points[:_ALIGNED], distance, start).apply(points)
    off = np.abs(distance(placed))
    width = 2 / float(np.percentile(off / sigma, 95))
    return Coverage(float((off <= 2 * sigma).mean()), width, float(np.median(sigma)), float(np.sqrt(np.mean(off**2))))


def _aligned(points: Floats, distance: Distance, start: SE3) -> SE3:
    """Return the rigid motion that brings points nearest to a surface."""
    motion = start
    for _ in range(_STEPS):
        here = motion.apply(points)
        off = distance(here)
        slopes = np.stack(
            [(distance(here + step) - distance(here - step)) / (2 * _NUDGE_M) for step in _NUDGE_M * np.eye(3)], axis=1
        )
        by_motion = np.concatenate([np.cross(here, slopes), slopes], axis=1)
        weighted = by_motion * ((np.abs(off) < _FAR_M) / (1 + (off / _ROBUST_M) ** 2))[:, np.newaxis]
        step = np.linalg.lstsq(by_motion.T @ weighted, weighted.T @ off, rcond=None)[0]
        motion = SE3.of(np.asarray(-step, np.float64)) @ motion
    return motion
