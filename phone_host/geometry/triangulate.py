"""Triangulation: the point in space that fits noisy rays of two or more cameras best, with its covariance. Pure.

Each camera c sees the point at slopes s_c = (x / z, y / z) in its own axes, with a covariance S_c. The best point has
the smallest sum of Mahalanobis distances between seen and projected slopes,

    sum over c of (s_c - project(T_c X))^T S_c^-1 (s_c - project(T_c X)),

which is the most likely one if the noise is Gaussian (Hartley and Sturm, "Triangulation", 1997: for two cameras and equal
noise their polynomial has the same optimum). It is found by Gauss-Newton from the linear solution. The unknowns are the
slopes a, b and the inverse depth w of the point in the first camera's axes (Montiel, Civera and Davison, 2006): in them
the projection R (a, b, 1) + t w is as good as linear at any distance, infinity included, so four steps are plenty and the
covariance (J^T S^-1 J)^-1 of the optimum holds for far points, too (Hartley and Zisserman, "Multiple View Geometry",
5.2.3). The point itself is (a, b, 1) / w.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STEPS: Final = 8
"""Gauss-Newton halves nothing but squares the error with each step: from rays that miss each other by a tenth of their
length, four steps end at rounding."""

_LEAST_PARALLAX_RAD: Final = 1e-9
"""Two rays that differ by less are one ray; half a micropixel of any camera is more."""


@dataclass(frozen=True, slots=True, eq=False)
class Intersections:
    """Best-fit intersections of N bundles of rays. NaN where there is none: parallel rays, or one behind a camera.

    Attributes:
        points_m: (N, 3) float64 in the first camera's axes, m.
        covariance_m2: (N, 3, 3) float64 of the points, to first order, m^2.
        parameters: (N, 3) float64 a, b and w: slopes and inverse depth (1/m); also of points beyond infinity (w <= 0).
        parameter_covariance: (N, 3, 3) float64 of these: what to carry through functions of far points.
        chi2: (N,) float64 sum of squared Mahalanobis distances; its expectation is 2 C - 3 for C cameras.
    """

    points_m: Floats
    covariance_m2: Floats
    parameters: Floats
    parameter_covariance: Floats
    chi2: Floats


def triangulate(slopes: Floats, covariances: Floats, poses: Sequence[SE3]) -> Intersections:
    """Find the points that fit rays best.

    Args:
        slopes: (C, N, 2) x / z and y / z at which camera c sees point n, in its own axes.
        covariances: (C, N, 2, 2) of the slopes; positive definite.
        poses: C motions T_c_0 from the first camera's axes to those of camera c; that of the first is the identity.

    Returns:
        N intersections.
    """
    weights = np.linalg.cholesky(np.linalg.inv(covariances))  # S^-1 = L L^T; residuals are L^T (seen - projected)
    upper = np.swapaxes(weights, -1, -2)
    q = _linear(slopes, poses)
    for _ in range(_STEPS):
        residuals, jacobian = _linearised(q, slopes, upper, poses)
        normal = np.einsum("nij,nik->njk", jacobian, jacobian)
        right = np.einsum("nij,ni->nj", jacobian, residuals)
        q = q + _solved(normal, right)
    residuals, jacobian = _linearised(q, slopes, upper, poses)
    normal = np.einsum("nij,nik->njk", jacobian, jacobian)
    covariance = _inverted(normal)
    in_front = (q[:, 2] > 0) & _in_front(q, poses)
    points = np.full_like(q, np.nan)
    np.divide(np.column_stack([q[:, :2], np.ones(len(q))]), q[:, 2:], out=points, where=in_front[:, None])
    spread = point_jacobian(q)
    return Intersections(
        points_m=points,
        covariance_m2=np.where(in_front[:, None, None], spread @ covariance @ np.swapaxes(spread, 1, 2), np.nan),
        parameters=q,
        parameter_covariance=covariance,
        chi2=np.einsum("ni,ni->n", residuals, residuals),
    )


def point_jacobian(parameters: Floats) -> Floats:
    """Return (N, 3, 3): how the points (a, b, 1) / w move with a, b and w, m; NaN for w <= 0.

    Args:
        parameters: (N, 3) a, b, w.
    """
    a, b, w = parameters.T
    z = 1 / np.where(w > 0, w, np.nan)
    zero = np.zeros_like(z)
    rows = (np.stack([z, zero, -a * z * z]), np.stack([zero, z, -b * z * z]), np.stack([zero, zero, -z * z]))
    return np.stack(rows).transpose(2, 0, 1)


def _directions(q: Floats, pose: SE3) -> Floats:
    """Return (N, 3) R (a, b, 1) + t w: the point times its inverse depth, in a camera's axes."""
    bundle: Floats = np.column_stack([q[:, :2], np.ones(len(q))]) @ pose.R.T + q[:, 2:] * pose.t_m
    return bundle


def _in_front(q: Floats, poses: Sequence[SE3]) -> Mask:
    return np.asarray(np.all([_directions(q, pose)[:, 2] > 0 for pose in poses], axis=0), np.bool_)


def _linear(slopes: Floats, poses: Sequence[SE3]) -> Floats:
    """Return (N, 3) a, b, w from the linear equations s_z-cross: x = s_x z, y = s_y z; NaN where rays are parallel."""
    rows, values = [], []
    for seen, pose in zip(slopes, poses, strict=True):
        for axis in (0, 1):
            # (R_axis - s R_z) (a, b, 1)^T + (t_axis - s t_z) w = 0
            turned = pose.R[axis] - seen[:, axis, None] * pose.R[2]
            rows.append(np.column_stack([turned[:, :2], pose.t_m[axis] - seen[:, axis] * pose.t_m[2]]))
            values.append(-turned[:, 2])
    design, wanted = np.stack(rows, axis=1), np.stack(values, axis=1)
    normal = np.einsum("nij,nik->njk", design, design)
    return _solved(normal, np.einsum("nij,ni->nj", design, wanted))


def _linearised(q: Floats, slopes: Floats, upper: Floats, poses: Sequence[SE3]) -> tuple[Floats, Floats]:
    """Return weighted residuals (N, 2 C) and their negative derivatives (N, 2 C, 3) by a, b and w."""
    residuals, jacobians = [], []
    for seen, factor, pose in zip(slopes, upper, poses, strict=True):
        p = _directions(q, pose)
        with np.errstate(divide="ignore", invalid="ignore"):
            projected = p[:, :2] / p[:, 2:]
            by_q = np.column_stack([pose.R[:, 0], pose.R[:, 1], pose.t_m])
            jacobian = (by_q[:2] - projected[:, :, None] * by_q[2]) / p[:, 2, None, None]
        residuals.append(np.einsum("nij,nj->ni", factor, seen - projected))
        jacobians.append(factor @ jacobian)
    return np.concatenate(residuals, axis=1), np.concatenate(jacobians, axis=1)


def _solvable(normal: Floats) -> Mask:
    """Return which of N normal matrices have an inverse: rays that are not parallel, and finite numbers."""
    scale = np.sqrt(np.abs(np.diagonal(normal, axis1=1, axis2=2)))
    usable: Mask = np.asarray(np.isfinite(normal).all(axis=(1, 2)) & (scale > 0).all(axis=1), np.bool_)
    scale = np.where(usable[:, None], scale, 1.0)
    correlation = np.where(usable[:, None, None], normal, np.eye(3)) / (scale[:, :, None] * scale[:, None, :])
    return np.asarray(usable & (np.linalg.eigvalsh(correlation)[:, 0] > _LEAST_PARALLAX_RAD**2), np.bool_)


def _solved(normal: Floats, right: Floats) -> Floats:
    good = _solvable(normal)
    solution = np.full_like(right, np.nan)
    solution[good] = np.linalg.solve(normal[good], right[good][..., None])[..., 0]
    return solution


def _inverted(normal: Floats) -> Floats:
    good = _solvable(normal)
    inverse = np.full_like(normal, np.nan)
    inverse[good] = np.linalg.inv(normal[good])
    return inverse
