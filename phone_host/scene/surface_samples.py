"""Spreads points evenly over the surface of a shape, with normals and the area that each stands for. Pure."""

import math
from dataclasses import dataclass
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.scene.cast import faces_and_normals
from phone_host.scene.scene_model import Box, Frustum, Plane, Shape, Sphere, Torus

_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSamples:
    """Points on a surface.

    Attributes:
        points: (3, N) float64, m.
        normals: (3, N) float64 outward.
        areas_m2: (N,) float64; together they are the surface's area.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    areas_m2: NDArray[np.float64]

    def where(self, chosen: NDArray[np.bool_]) -> "SurfaceSamples":
        """Return those that `chosen` (N,) names."""
        return SurfaceSamples(self.points[:, chosen], self.normals[:, chosen], self.areas_m2[chosen])


def samples_of(shape: Shape, spacing_m: float) -> SurfaceSamples:
    """Spread points over a solid's surface."""
    match shape:
        case Box(size_m):
            parts = [_rectangle(size_m, axis, side, spacing_m) for axis in range(3) for side in (-0.5, 0.5)]
        case Sphere(radius_m):
            count = max(8, round(4.0 * math.pi * (radius_m / spacing_m) ** 2))
            index = np.arange(count) + 0.5
            z = 1.0 - 2.0 * index / count
            around = np.sqrt(1.0 - z * z)
            unit = np.stack([around * np.cos(_GOLDEN * index), around * np.sin(_GOLDEN * index), z])
            parts = [(unit * radius_m, np.full(count, 4.0 * math.pi * radius_m**2 / count))]
        case Frustum():
            half = shape.height_m / 2.0
            parts = [
                _side(shape, spacing_m),
                _disc(shape.bottom_radius_m, -half, spacing_m),
                _disc(shape.top_radius_m, half, spacing_m),
            ]
        case Torus(ring_radius_m, tube_radius_m):
            parts = [_tube(ring_radius_m, tube_radius_m, spacing_m)]
        case Plane():
            raise ValueError("a plane is no solid")
        case _:
            assert_never(shape)
    points = np.concatenate([part[0] for part in parts], axis=1)
    normals = faces_and_normals(shape, points)[1].astype(np.float64)
    return SurfaceSamples(points, normals, np.concatenate([part[1] for part in parts]))


_Part = tuple[NDArray[np.float64], NDArray[np.float64]]


def _middles(length: float, spacing: float) -> NDArray[np.float64]:
    """Return the middles of equal pieces of -length / 2 to length / 2."""
    count = max(1, round(length / spacing))
    return ((np.arange(count) + 0.5) / count - 0.5) * length


def _rectangle(size_m: tuple[float, float, float], axis: int, side: float, spacing_m: float) -> _Part:
    first, second = (axis + 1) % 3, (axis + 2) % 3
    a, b = (
        each.ravel() for each in np.meshgrid(_middles(size_m[first], spacing_m), _middles(size_m[second], spacing_m))
    )
    points = np.empty((3, a.size))
    points[axis], points[first], points[second] = side * size_m[axis], a, b
    return points, np.full(a.size, size_m[first] * size_m[second] / a.size)


def _disc(radius_m: float, z_m: float, spacing_m: float) -> _Part:
    if radius_m == 0.0:
        return np.zeros((3, 0)), np.zeros(0)
    count = max(1, round(math.pi * (radius_m / spacing_m) ** 2))
    index = np.arange(count) + 0.5
    rho, angle = radius_m * np.sqrt(index / count), _GOLDEN * index
    points = np.stack([rho * np.cos(angle), rho * np.sin(angle), np.full(count, z_m)])
    return points, np.full(count, math.pi * radius_m**2 / count)


def _side(shape: Frustum, spacing_m: float) -> _Part:
    long_ = math.hypot(shape.height_m, shape.top_radius_m - shape.bottom_radius_m)
    heights = _middles(1.0, spacing_m / long_)
    rings = []
    for height in heights.tolist():
        radius = shape.bottom_radius_m + (shape.top_radius_m - shape.bottom_radius_m) * (height + 0.5)
        rings.append(_ring(radius, height * shape.height_m, spacing_m, long_ / heights.size))
    return np.concatenate([ring[0] for ring in rings], axis=1), np.concatenate([ring[1] for ring in rings])


def _tube(ring_radius_m: float, tube_radius_m: float, spacing_m: float) -> _Part:
    count = max(8, round(2.0 * math.pi * tube_radius_m / spacing_m))
    rings = []
    for number in range(count):
        angle = 2.0 * math.pi * (number + 0.5) / count
        radius, z = ring_radius_m + tube_radius_m * math.cos(angle), tube_radius_m * math.sin(angle)
        rings.append(_ring(radius, z, spacing_m, 2.0 * math.pi * tube_radius_m / count))
    return np.concatenate([ring[0] for ring in rings], axis=1), np.concatenate([ring[1] for ring in rings])


def _ring(radius_m: float, z_m: float, spacing_m: float, width_m: float) -> _Part:
    count = max(6, round(2.0 * math.pi * radius_m / spacing_m))
    angle = 2.0 * math.pi * np.arange(count) / count + z_m / spacing_m
    points = np.stack([radius_m * np.cos(angle), radius_m * np.sin(angle), np.full(count, z_m)])
    return points, np.full(count, 2.0 * math.pi * radius_m * width_m / count)
