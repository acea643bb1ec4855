"""Where a depth image lies against a surface: point to plane, in the directions that the surface tells. Pure.

The start counts as a measurement, too. Depths of a matcher err together in patches, so that a wall of noisy depths tells less than corners do.

Source: A. W. Fitzgibbon, "Robust registration of 2D and 3D point sets", 2003 (the robust weight); J. Zhang et al., "On degeneracy of
optimization-based state estimation problems", 2016 (directions without information keep their start).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.native.library import Library
from phone_host.native.volume_jobs import RegisterJob
from phone_host.scan.view import Depth
from phone_host.scan.volume import Surface, aim, rows_of

Floats = NDArray[np.float64]

HUBER_SIGMAS: Final = 1.5
_ROUNDS: Final = ((4, 6), (2, 5), (1, 3))
"""Steps between the pixels, and searches at each: coarse, then fine."""

_JUDGED_STEP: Final = 2
"""Of the pixels that tell how well the result fits."""

_STILL: Final = 2e-5
"""rad and m: a step as short as this ends a round."""

_LEAST_PARTNERS: Final = 300
"""Of the finest round's pixels; the coarse ones need their share."""

_TOLD: Final = 2e-3
"""A direction whose information is less than this share of the best one's keeps its start. A plane gives 1e-4, the poorest real room
4e-3; noise of the normals can lift a plane above it, then the start's own certainty holds (`start_shift_m`)."""

_UPPER: Final = np.triu_indices(6)
SUMS: Final = 31


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistrationSettings:
    """How depths are compared with a surface.

    Attributes:
        most_m: partners lie no farther apart, m.
        floor_m: least noise of a distance, m: that of the surface itself.
        noise_per_m: standard deviation of a depth 1 m away, m; it grows with the depth squared.
        patch_px: side of the patches whose depths err together, px; each counts as one measurement beside the start.
        start_turn: standard deviation of the start's turn, rad; infinite = nothing is known of it.
        start_shift_m: and of its shift, m.
        geometry: of both.
        threads: that the library uses; results do not depend on them.
    """

    most_m: float
    floor_m: float
    noise_per_m: float
    geometry: StereoGeometry
    patch_px: float = 1.0
    start_turn: float = float("inf")
    start_shift_m: float = float("inf")
    threads: int = 1


ALL_DIRECTIONS: Final = 6
"""Three ways to shift and three to turn."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Registered:
    """A depth image that was laid against a surface.

    Attributes:
        start_now: takes the depth's points to where they belong, in the axes in which the search began; the identity moves nothing.
        overlap: share of the pixels in view that have a partner, 0..1.
        near: share of the partners within 3 standard deviations, 0..1.
        off_m: mean distance of the partners along the normals, m; NaN without any.
        noise_m: mean standard deviation of such a distance, by the noise of the depths and the surface's own, m; NaN without any.
        told: directions that the surface told, 0..6.
        least_told: information about the direction that the surface tells least, as a share of that about the one that it tells best.
    """

    start_now: SE3
    overlap: float
    near: float
    off_m: float
    noise_m: float
    told: int
    least_told: float = 0.0

    @property
    def is_determined(self) -> bool:
        """Whether the surface told all six directions: the depths cannot slide along it."""
        return self.told == ALL_DIRECTIONS


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Where a depth image is tried: a motion of its points, and the step between the pixels that are looked at."""

    motion: SE3
    step: int


def registered(depth_m: Depth, surface: Surface, settings: RegistrationSettings, library: Library | None) -> Registered:
    """Lay a depth image against the surface that was cast from where the camera is believed to be.

    Args:
        depth_m: (H, W) float32, m, NaN = none, packed.
        surface: of the same size, in the believed camera's axes.
        settings: how.
        library: computes; None: numpy does.

    Returns:
        The motion; where too few points have partners, as far as it came.
    """
    if surface.points_m.shape != (*depth_m.shape, 3) or surface.normals.shape != surface.points_m.shape:
        raise ValueError(f"a surface {surface.points_m.shape} for a depth {depth_m.shape}")
    motion, told, least = SE3.identity(), 0, 0.0
    noise_m = _noise_m(depth_m, surface, settings)
    for step, searches in _ROUNDS:
        for _ in range(searches):
            trial = Trial(motion, step)
            sums = summed(depth_m, surface, settings, trial, library)
            if sums[29] * step * step < _LEAST_PARTNERS:
                return _registered_at(motion, sums, 0, 0.0, noise_m)
            move, told, least = _step(sums, settings, trial)
            motion = SE3.of(move) @ motion
            if np.abs(move).max() < _STILL:
                break
    return _registered_at(
        motion, summed(depth_m, surface, settings, Trial(motion, _JUDGED_STEP), library), told, least, noise_m
    )


def _noise_m(depth_m: Depth, surface: Surface, settings: RegistrationSettings) -> float:
    """Return how far depths lie from a surface along its normals by their noise alone, m; NaN: none lies near it.

    The error of a depth moves its point along the ray: what a wall beside the camera shows of it is less than what a wall ahead shows.
    """
    step = slice(None, None, _JUDGED_STEP)
    points, normals, depth = surface.points_m[step, step], surface.normals[step, step], depth_m[step, step]
    near = np.abs(points[..., 2] - depth) <= settings.most_m  # false for NaN
    points, normals = points[near].astype(np.float64), normals[near].astype(np.float64)
    across = np.abs((points * normals).sum(axis=1)) / points[:, 2]
    sigmas = settings.floor_m + settings.noise_per_m * points[:, 2] ** 2 * across
    return float(np.nanmean(sigmas)) if np.isfinite(sigmas).any() else float("nan")


def _registered_at(motion: SE3, sums: Floats, told: int, least: float, noise_m: float) -> Registered:
    near, off_m, partners, visible = sums[27:]
    return Registered(
        start_now=motion,
        overlap=float(partners / max(visible, 1)),
        near=float(near / max(partners, 1)),
        off_m=float(off_m / partners) if partners else float("nan"),
        noise_m=noise_m,
        told=told,
        least_told=least,
    )


def _step(sums: Floats, settings: RegistrationSettings, trial: Trial) -> tuple[Floats, int, float]:
    """Solve the equations; return the motion (6,), how many directions the surface tells, and how well the least one, 0..1."""
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = sums[:21]
    matrix += np.triu(matrix, 1).T
    # Turns and shifts have different units: each is measured by what it moves the points on average.
    lever = np.sqrt(np.trace(matrix[:3, :3]) / max(np.trace(matrix[3:, 3:]), np.finfo(float).tiny))
    scale = np.repeat([1 / max(lever, 1e-6), 1.0], 3)
    share = min(trial.step**2 / settings.patch_px**2, 1.0)
    values, vectors = np.linalg.eigh(share * matrix * np.outer(scale, scale))
    told = values > _TOLD * values[-1]
    along = vectors[:, told]
    prior = scale**2 * np.repeat([settings.start_turn**-2, settings.start_shift_m**-2], 3)
    right = along @ (along.T @ (share * scale * sums[21:27])) - prior * trial.motion.pose() / scale
    whole = (along * values[told]) @ along.T + np.diag(prior)
    return (
        scale * (np.linalg.pinv(whole, hermitian=True) @ right),
        int(np.count_nonzero(told)),
        float(values[0] / max(values[-1], np.finfo(float).tiny)),
    )


def summed(
    depth_m: Depth, surface: Surface, settings: RegistrationSettings, trial: Trial, library: Library | None
) -> Floats:
    """Return the (31,) sums that native/src/register.c describes; the same for any number of threads."""
    if library is None:
        return _by_numpy(depth_m, surface, settings, trial)
    sums = np.empty((-(-depth_m.shape[0] // trial.step), SUMS))
    points, normals = np.ascontiguousarray(surface.points_m), np.ascontiguousarray(surface.normals)
    depth = np.ascontiguousarray(depth_m)
    job = RegisterJob(
        depth_m=depth.ctypes.data,
        points_m=points.ctypes.data,
        normals=normals.ctypes.data,
        sums=sums.ctypes.data,
        model_camera=rows_of(trial.motion),
        most_m=settings.most_m,
        floor_m=settings.floor_m,
        noise_per_m=settings.noise_per_m,
        huber_sigmas=HUBER_SIGMAS,
        step=trial.step,
        threads=settings.threads,
    )
    aim(job, settings.geometry, depth_m.shape)
    library.run(job)
    return np.asarray(sums.sum(axis=0), np.float64)


def _by_numpy(depth_m: Depth, surface: Surface, settings: RegistrationSettings, trial: Trial) -> Floats:
    (height, width), geometry, step = depth_m.shape, settings.geometry, trial.step
    rows, columns = np.mgrid[0:height:step, 0:width:step]
    depth = depth_m[rows, columns]
    seen = depth > 0
    z = depth[seen].astype(np.float64)
    x = (columns[seen] - geometry.cx_px) / geometry.focal_px * z
    y = (rows[seen] - geometry.cy_px) / geometry.focal_px * z
    points = trial.motion.apply(np.column_stack([x, y, z]))
    points = points[points[:, 2] > 1e-3]
    across = np.floor(geometry.focal_px * points[:, 0] / points[:, 2] + geometry.cx_px + 0.5).astype(np.int64)
    down = np.floor(geometry.focal_px * points[:, 1] / points[:, 2] + geometry.cy_px + 0.5).astype(np.int64)
    inside = (across >= 0) & (down >= 0) & (across < width) & (down < height)
    points, at = points[inside], (down[inside], across[inside])
    difference, normals = surface.points_m[at] - points, surface.normals[at].astype(np.float64)
    usable = ((difference**2).sum(axis=1) <= settings.most_m**2) & np.isfinite(normals[:, 0])
    points, difference, normals = points[usable], difference[usable], normals[usable]
    off = (normals * difference).sum(axis=1)
    jacobian = np.column_stack([np.cross(points, normals), normals])
    sigma = settings.floor_m + settings.noise_per_m * points[:, 2] ** 2
    sigmas = np.abs(off) / sigma
    weight = np.minimum(1, HUBER_SIGMAS / np.maximum(sigmas, 1e-12)) / sigma**2
    matrix = (jacobian * weight[:, np.newaxis]).T @ jacobian
    counts = [np.count_nonzero(sigmas < 3), np.abs(off).sum(), len(points), np.count_nonzero(inside)]
    return np.concatenate([matrix[_UPPER], jacobian.T @ (weight * off), counts])
