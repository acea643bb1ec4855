"""Casts rays: the direction of each pixel, and what a ray hits first.

Vectors are stored with one coordinate per row, (3, N), because numpy is fastest along contiguous rows. The dtype of the
rays sets the precision of everything that follows. Directions are not normalised: a camera's rays have z = 1 in its own
axes, so the ray parameter of a hit *is* its depth.
"""

import math
from dataclasses import dataclass
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry import lens
from phone_host.model import CameraModel, Lens
from phone_host.scene.round_shapes import dot, frustum_faces, frustum_normals, meet_frustum, meet_torus, torus_normals
from phone_host.scene.scene_model import Body, Box, Floats, Frustum, Plane, Pose, Shape, Sphere, Torus, Vector

FACES = 8
"""Surface numbers per body: surface = body index * FACES + face. A box has six faces, a frustum three, every other body has one."""

NOTHING = -1
"""Surface number of a ray that hits nothing."""

BATCH = 16384
"""Rays handled at a time. The working arrays then stay in the caches, and products of this size are too small for the
linear algebra library to wake its threads. Measured as the best choice from 8192 up to all rays at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What N rays hit.

    Attributes:
        depth: (N,) ray parameter of the nearest hit; inf = nothing.
        surface: (N,) int16 surface number; NOTHING = none.
    """

    depth: Floats
    surface: NDArray[np.int16]


def pixel_rays(model: CameraModel) -> NDArray[np.float64]:
    """Return the directions through all pixel centres in the camera's axes, with distortion undone.

    Args:
        model: intrinsics of the camera; the distortion must be invertible inside the image.

    Returns:
        (3, H, W) float64 with z = 1.
    """
    x, y = np.meshgrid(np.arange(model.width_px, dtype=np.float64), np.arange(model.height_px, dtype=np.float64))
    return rays_through(model, x.ravel(), y.ravel()).reshape(3, *x.shape)


def rays_through(model: CameraModel, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the directions through given image points in the camera's axes.

    Args:
        model: intrinsics of the camera.
        x: (N,) px.
        y: (N,) px.

    Returns:
        (3, N) float64 with z = 1.
    """
    k = model.matrix
    if model.lens is not Lens.FISHEYE and not np.any(model.distortion):
        y_unit = (y - k[1, 2]) / k[1, 1]
        return np.stack([(x - k[0, 2] - k[0, 1] * y_unit) / k[0, 0], y_unit, np.ones_like(x)])
    rays = lens.rays_through(np.stack([x, y], axis=1), model)
    return np.stack([rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2], np.ones_like(x)])


def project(points_m: Floats, model: CameraModel, pose: Pose) -> NDArray[np.float64]:
    """Project points in the scene's axes to pixel coordinates, distortion included.

    Args:
        points_m: (3, N) float64.
        model: intrinsics of the camera.
        pose: where the camera stands.

    Returns:
        (2, N) float64 px; NaN for points behind the camera.
    """
    local = pose.R_camera_scene @ (points_m - pose.centre_m[:, None])
    ahead = local[2] > 0.0
    pixels = np.full((2, points_m.shape[1]), np.nan)
    if model.lens is not Lens.FISHEYE and not np.any(model.distortion):
        across = model.matrix[:2] @ local[:, ahead]
        pixels[:, ahead] = across / local[2, ahead]
    elif np.any(ahead):
        seen = np.ascontiguousarray(local[:, ahead].T)
        pixels[:, ahead] = lens.project(seen, model).T
    return pixels


def intersect(shape: Shape, origin: Floats, rays: Floats) -> Floats:
    """Compute the ray parameter of the first hit from outside, in the body's axes.

    Args:
        shape: the shape to hit.
        origin: (3,) start of all rays, outside the shape.
        rays: (3, N) directions.

    Returns:
        (N,) parameter > 0, inf = missed; dtype of `rays`.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        match shape:
            case Plane(width_m, height_m):
                depth, hit = _meet_plane(width_m, height_m, origin, rays)
            case Box(size_m):
                depth, leave = box_interval(size_m, origin[:, None], rays)
                hit = (depth <= leave) & (depth > 0.0)
            case Sphere(radius_m):
                square = dot(rays, rays)
                half = origin @ rays
                root = half * half - square * (origin @ origin - radius_m * radius_m)
                depth = (-half - np.sqrt(root)) / square
                hit = (root >= 0.0) & (depth > 0.0)
            case Frustum():
                depth = meet_frustum(shape, origin, rays)
                hit = np.isfinite(depth)
            case Torus():
                depth = meet_torus(shape, origin, rays)
                hit = np.isfinite(depth)
            case _:
                assert_never(shape)
        return np.where(hit, depth, rays.dtype.type(np.inf))


def _meet_plane(width_m: float, height_m: float, origin: Floats, rays: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the ray parameters (N,) at z = 0 and whether they lie inside the rectangle."""
    depth = -origin[2] / rays[2]
    hit = depth > 0.0
    # An infinite side is not compared, because infinity times zero is NaN.
    if math.isfinite(width_m):
        hit &= np.abs(origin[0] + depth * rays[0]) <= width_m / 2.0
    if math.isfinite(height_m):
        hit &= np.abs(origin[1] + depth * rays[1]) <= height_m / 2.0
    return depth, hit


def box_interval(size_m: tuple[float, float, float], origin: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """Compute where rays enter and leave a box (slab method, Kay and Kajiya 1986); entry > exit means missed.

    Args:
        size_m: edge lengths.
        origin: (3, N) or (3, 1) starts in the box's axes.
        rays: (3, N) or (3, 1) directions.

    Returns:
        (N,) entry and (N,) exit parameters.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / rays
        middle = -origin * inverse
        reach = np.abs(inverse) * column(size_m, rays) / 2.0
        near = np.max(middle - reach, axis=0)
        far = np.min(middle + reach, axis=0)
    return near, far


def faces_and_normals(shape: Shape, points: Floats) -> tuple[NDArray[np.int16], Floats]:
    """Return face number and outward normal at surface points, in the body's axes.

    Args:
        shape: the shape whose surface it is.
        points: (3, N) points on it.

    Returns:
        (N,) int16 and (3, N) unit vectors.
    """
    count = points.shape[1]
    match shape:
        case Plane():
            normals = np.zeros_like(points)
            normals[2] = -1.0
            return np.zeros(count, dtype=np.int16), normals
        case Sphere(radius_m):
            return np.zeros(count, dtype=np.int16), points / points.dtype.type(radius_m)
        case Box(size_m):
            relative = points / column(size_m, points)
            axis = np.argmax(np.abs(relative), axis=0)
            each = np.arange(count)
            side = np.sign(relative[axis, each])
            normals = np.zeros_like(points)
            normals[axis, each] = side
            return (2 * axis + (side > 0)).astype(np.int16), normals
        case Frustum():
            faces = frustum_faces(shape, points)
            return faces, frustum_normals(shape, points, faces)
        case Torus():
            return np.zeros(count, dtype=np.int16), torus_normals(shape, points)
        case _:
            assert_never(shape)


def column(vector: Vector | NDArray[np.float64], like: Floats) -> Floats:
    """Return a vector as a (3, 1) column of another array's dtype."""
    values: Floats = np.array(vector, dtype=np.float64).astype(like.dtype)
    return values[:, None]


def to_body(body: Body, points: Floats) -> Floats:
    """Convert points (3, N) from the scene's axes to the body's axes, same dtype."""
    local: Floats = body.R_scene_body.T.astype(points.dtype) @ (points - column(body.position_m, points))
    return local


def cast(bodies: tuple[Body, ...], origin: Floats, rays: Floats) -> Hits:
    """Find the first hit of each ray among all bodies.

    Args:
        bodies: the scene's bodies.
        origin: (3,) common start in the scene's axes.
        rays: (3, N) directions in the scene's axes.
    """
    hits = Hits(np.full(rays.shape[1], np.inf, dtype=rays.dtype), np.full(rays.shape[1], NOTHING, dtype=np.int16))
    for index, body in enumerate(bodies):
        cast_one(index, body, origin, rays, hits)
    return hits


def cast_one(index: int, body: Body, origin: Floats, rays: Floats, hits: Hits) -> None:
    """Update `hits` in place where one more body is hit first.

    Args:
        index: the body's number.
        body: the body.
        origin: (3,) common start of the rays.
        rays: (3, N) directions.
        hits: N depths and surfaces so far.
    """
    local_origin = to_body(body, origin.astype(rays.dtype)[:, None])
    turn = body.R_scene_body.T.astype(rays.dtype)
    for start in range(0, rays.shape[1], BATCH):
        part = slice(start, start + BATCH)
        local_rays: Floats = turn @ rays[:, part]
        depth = intersect(body.shape, local_origin[:, 0], local_rays)
        first = np.flatnonzero(depth < hits.depth[part])
        if first.size:
            points = local_origin + depth[first] * local_rays[:, first]
            hits.depth[part][first] = depth[first]
            hits.surface[part][first] = faces_and_normals(body.shape, points)[0] + index * FACES
