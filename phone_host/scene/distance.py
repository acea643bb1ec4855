"""How far points are from a shape, exactly: the nearest point of its surface, and whether they lie inside. Pure.

Everything is float64, (3, N), in the axes of the shape.
"""

import itertools
from dataclasses import dataclass
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.scene.scene_model import Box, Frustum, Plane, Shape, Sphere, Torus

Points = NDArray[np.float64]
"""(3, N) float64, m."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """Where a surface is nearest to N points.

    Attributes:
        points: (3, N) float64 on the surface.
        signed_m: (N,) float64 distance to it; negative inside.
    """

    points: Points
    signed_m: NDArray[np.float64]


def nearest_on(shape: Shape, points: Points) -> Nearest:
    """Find the nearest points of a solid's surface.

    Args:
        shape: a solid; a plane has no inside.
        points: (3, N) float64.
    """
    match shape:
        case Box(size_m):
            found, inside = _nearest_on_box(np.asarray(size_m)[:, None] / 2.0, points)
        case Sphere(radius_m):
            length = np.linalg.norm(points, axis=0)
            found, inside = _scaled(points, length, radius_m), length < radius_m
        case Torus(ring_radius_m, tube_radius_m):
            rho = np.hypot(points[0], points[1])
            ring = np.zeros_like(points)
            ring[:2] = _scaled(points[:2], rho, ring_radius_m)
            away = points - ring
            length = np.linalg.norm(away, axis=0)
            found, inside = ring + _scaled(away, length, tube_radius_m), length < tube_radius_m
        case Frustum():
            found, inside = _nearest_on_frustum(shape, points)
        case Plane():
            raise ValueError("a plane has no inside")
        case _:
            assert_never(shape)
    distance = np.linalg.norm(points - found, axis=0)
    return Nearest(found, np.where(inside, -distance, distance))


def _scaled(vectors: Points, lengths: NDArray[np.float64], to_m: float) -> Points:
    """Return vectors with another length; where there is no direction, along the first axis."""
    some = lengths > 0.0
    unit = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=some)
    unit[0] = np.where(some, unit[0], 1.0)
    return unit * to_m


def _nearest_on_box(half: Points, points: Points) -> tuple[Points, NDArray[np.bool_]]:
    clipped = np.clip(points, -half, half)
    inside = np.asarray((np.abs(points) < half).all(axis=0))
    # From inside, the nearest face is pushed to.
    axis = np.argmin(half - np.abs(points), axis=0)
    each = np.arange(points.shape[1])
    pushed = clipped.copy()
    pushed[axis, each] = np.where(points[axis, each] < 0.0, -half[axis, 0], half[axis, 0])
    return np.where(inside, pushed, clipped), inside


def nearest_on_faces(shape: Shape, points: Points) -> list[Points]:
    """Find the nearest point of each smooth face of a solid's surface, (3, N) each.

    The nearest of all may be no surface, where another solid hides it; then that of another face may be the nearest.
    """
    match shape:
        case Box(size_m):
            half = np.asarray(size_m)[:, None] / 2.0
            found = []
            for axis in range(3):
                for side in (-1.0, 1.0):
                    face = np.clip(points, -half, half)
                    face[axis] = side * half[axis, 0]
                    found.append(face)
            return found
        case Frustum():
            around = _scaled(points[:2], np.hypot(points[0], points[1]), 1.0)
            return [np.concatenate([around * edge[0], edge[1:]]) for edge in _edges(shape, points)]
        case _:
            return [nearest_on(shape, points).points]


def _edges(shape: Frustum, points: Points) -> list[NDArray[np.float64]]:
    """Return the nearest points of bottom, side and top in the half plane through the axis, (2, N) each: distance from the axis, z."""
    half, bottom, top = shape.height_m / 2.0, shape.bottom_radius_m, shape.top_radius_m
    place = np.stack([np.hypot(points[0], points[1]), points[2]])
    corners = np.array([[0.0, -half], [bottom, -half], [top, half], [0.0, half]])
    found = []
    for start, end in itertools.pairwise(corners):
        edge = end - start
        square = float(edge @ edge)
        share = np.clip((edge @ (place - start[:, None])) / square, 0.0, 1.0) if square else np.zeros(place.shape[1])
        found.append(start[:, None] + edge[:, None] * share)
    return found


def _nearest_on_frustum(shape: Frustum, points: Points) -> tuple[Points, NDArray[np.bool_]]:
    edges = np.array(nearest_on_faces(shape, points))
    which = np.argmin(((edges - points) ** 2).sum(axis=1), axis=0)
    rho, half = np.hypot(points[0], points[1]), shape.height_m / 2.0
    wide = (shape.bottom_radius_m + shape.top_radius_m) / 2.0
    slope = (shape.top_radius_m - shape.bottom_radius_m) / shape.height_m
    inside = np.asarray((np.abs(points[2]) < half) & (rho < wide + slope * points[2]))
    return edges[which, :, np.arange(points.shape[1])].T, inside
