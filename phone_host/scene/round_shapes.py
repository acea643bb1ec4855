"""Where rays meet cones and rings, and how these surfaces face. Pure.

Arrays are (3, N) in the axes of the shape, as everywhere in `cast`. A ring's equation has the degree four, so it is solved in
float64 whatever the rays are.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scene.scene_model import Floats, Frustum, Torus

SIDE: Final = 0
"""Face of a frustum between its two caps."""

_BOTTOM, _TOP = 1, 2

_REAL: Final = 1e-5
"""A root with a smaller imaginary part, in tube radii, is real: where a ray grazes a ring, two real ones meet."""

_POLISHED: Final = 4
"""Newton's steps; each squares the root's error."""


def dot(a: Floats, b: Floats) -> Floats:
    """Return the inner products (N,) of vectors (3, N); written out, this is three times as fast as einsum."""
    product: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def meet_frustum(shape: Frustum, origin: Floats, rays: Floats) -> Floats:
    """Compute the ray parameter of the first hit from outside.

    Args:
        shape: the frustum.
        origin: (3,) start of all rays, outside.
        rays: (3, N) directions.

    Returns:
        (N,) parameter > 0, inf = missed; dtype of `rays`.
    """
    infinite = rays.dtype.type(np.inf)
    half, slope, middle = shape.height_m / 2.0, _slope(shape), (shape.bottom_radius_m + shape.top_radius_m) / 2.0
    best = np.full(rays.shape[1], infinite, dtype=rays.dtype)
    with np.errstate(divide="ignore", invalid="ignore"):
        for z, radius in ((-half, shape.bottom_radius_m), (half, shape.top_radius_m)):
            depth = (z - origin[2]) / rays[2]
            across = (origin[0] + depth * rays[0]) ** 2 + (origin[1] + depth * rays[1]) ** 2
            best = np.where((depth > 0.0) & (across <= radius * radius) & (depth < best), depth, best)
        # On the side, x^2 + y^2 = (middle + slope z)^2.
        start, grow = middle + slope * origin[2], slope * rays[2]
        a = rays[0] ** 2 + rays[1] ** 2 - grow**2
        b = origin[0] * rays[0] + origin[1] * rays[1] - start * grow
        root = np.sqrt(b * b - a * (origin[0] ** 2 + origin[1] ** 2 - start**2))
        for depth in ((-b - root) / a, (-b + root) / a):
            z = origin[2] + depth * rays[2]
            # The other half of the double cone has a negative radius.
            inside = (np.abs(z) <= half) & (middle + slope * z >= 0.0)
            best = np.where(inside & (depth > 0.0) & (depth < best), depth, best)
    return best


def frustum_faces(shape: Frustum, points: Floats) -> NDArray[np.int16]:
    """Return the face (N,) of points (3, N) on a frustum: its side, its bottom or its top."""
    half = shape.height_m / 2.0
    off_side = np.abs(_side_distance(shape, points))
    off_bottom, off_top = np.abs(points[2] + half), np.abs(points[2] - half)
    faces: NDArray[np.int16] = np.argmin([off_side, off_bottom, off_top], axis=0).astype(np.int16)
    return faces


def frustum_normals(shape: Frustum, points: Floats, faces: NDArray[np.int16]) -> Floats:
    """Return outward unit normals (3, N) at points (3, N) on the given faces of a frustum."""
    rho = np.maximum(np.hypot(points[0], points[1]), np.finfo(points.dtype).tiny)
    slope = _slope(shape)
    long_ = float(np.hypot(1.0, slope))
    side = np.stack([points[0] / rho, points[1] / rho, np.full_like(rho, -slope)]) / points.dtype.type(long_)
    cap = np.zeros_like(points)
    cap[2] = np.where(faces == _TOP, 1.0, -1.0)
    return np.where(faces == SIDE, side, cap)


def meet_torus(shape: Torus, origin: Floats, rays: Floats) -> Floats:
    """Compute the ray parameter of the first hit from outside, from the roots of the ring's equation.

    Args:
        shape: the ring.
        origin: (3,) start of all rays, outside.
        rays: (3, N) directions.

    Returns:
        (N,) parameter > 0, inf = missed; dtype of `rays`.
    """
    depth = np.full(rays.shape[1], np.inf)
    start, length = origin.astype(np.float64), np.linalg.norm(rays.astype(np.float64), axis=0)
    unit = rays.astype(np.float64) / length
    nearest = -(start @ unit)
    foot = start[:, None] + nearest * unit
    reach = shape.ring_radius_m + shape.tube_radius_m
    # In tube radii, and from the point of the ray next to the middle: the coefficients are then of one size.
    at = np.flatnonzero((dot(foot, foot) <= reach * reach) & _crosses_slab(shape, foot, unit, reach))
    if at.size:
        scale = shape.tube_radius_m
        roots = _first_roots(shape.ring_radius_m / scale, foot[:, at] / scale, unit[:, at])
        found = (nearest[at] + roots * scale) / length[at]
        depth[at] = np.where(found > 0.0, found, np.inf)
    return depth.astype(rays.dtype)


def torus_normals(shape: Torus, points: Floats) -> Floats:
    """Return outward unit normals (3, N) at points (3, N) on a ring."""
    rho = np.maximum(np.hypot(points[0], points[1]), np.finfo(points.dtype).tiny)
    share = points.dtype.type(shape.ring_radius_m) / rho
    away = points - np.stack([points[0] * share, points[1] * share, np.zeros_like(rho)])
    normals: Floats = away / np.sqrt(dot(away, away))
    return normals


def _slope(shape: Frustum) -> float:
    return (shape.top_radius_m - shape.bottom_radius_m) / shape.height_m


def _side_distance(shape: Frustum, points: Floats) -> Floats:
    slope, middle = _slope(shape), (shape.bottom_radius_m + shape.top_radius_m) / 2.0
    away = np.hypot(points[0], points[1]) - (middle + slope * points[2])
    distance: Floats = away / np.hypot(1.0, slope)
    return distance


def _crosses_slab(shape: Torus, foot: Floats, unit: Floats, reach: float) -> NDArray[np.bool_]:
    """Return whether a ray passes between the planes that touch a ring's both sides, within its reach."""
    low = np.minimum(foot[2] - reach * unit[2], foot[2] + reach * unit[2])
    high = np.maximum(foot[2] - reach * unit[2], foot[2] + reach * unit[2])
    crosses: NDArray[np.bool_] = (low <= shape.tube_radius_m) & (high >= -shape.tube_radius_m)
    return crosses


def _first_roots(ring: float, foot: Floats, unit: Floats) -> Floats:
    """Return the least root (N,) of (p^2 + R^2 - 1)^2 = 4 R^2 (x^2 + y^2) along rays p = foot + t unit, with foot at a right angle to unit."""
    k = dot(foot, foot) + ring * ring - 1.0
    flat = unit[0] ** 2 + unit[1] ** 2
    mixed = foot[0] * unit[0] + foot[1] * unit[1]
    far = foot[0] ** 2 + foot[1] ** 2
    # t^4 + (2 k - 4 R^2 flat) t^2 - 8 R^2 mixed t + k^2 - 4 R^2 far: there is no t^3, because foot . unit = 0.
    c2, c1 = 2.0 * k - 4.0 * ring * ring * flat, -8.0 * ring * ring * mixed
    c0 = k * k - 4.0 * ring * ring * far
    companion = np.zeros((foot.shape[1], 4, 4))
    companion[:, (1, 2, 3), (0, 1, 2)] = 1.0
    companion[:, 0, 3], companion[:, 1, 3], companion[:, 2, 3] = -c0, -c1, -c2
    roots = np.linalg.eigvals(companion)
    least = np.where(np.abs(roots.imag) < _REAL, roots.real, np.inf).min(axis=1)
    hit = np.isfinite(least)
    t = np.where(hit, least, 0.0)
    for _ in range(_POLISHED):
        value, rate = ((t * t + c2) * t + c1) * t + c0, (4.0 * t * t + 2.0 * c2) * t + c1
        step = np.divide(value, rate, out=np.zeros_like(t), where=np.abs(rate) > np.abs(value))
        t = t - step
    return np.where(hit, t, np.inf)
