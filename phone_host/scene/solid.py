"""A thing made of solids that touch or overlap: its surface, the distance to it, its volume. Pure.

Outside, the distance to a union is the least of the distances to its parts. Inside it is not: a part's surface that lies
within another part is no surface of the thing. There the nearest points that are buried are replaced by points of the
seams, in which two parts meet; these lie on the seam exactly and `_SEAM_M` apart along it.

What makes a scan hard is one thing at a time: a speckled surface is the easy case, thin parts, a shiny surface and a surface
without texture are not.
"""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.scene.cast import faces_and_normals
from phone_host.scene.distance import Points, nearest_on, nearest_on_faces
from phone_host.scene.scene_model import Body, Box, Frustum, Plane, Shape, Sphere, Texture, Torus, Vector, rotation

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
    """Spread points over a solid's surface.

    Args:
        shape: the solid.
        spacing_m: distance between neighbours, about.
    """
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


_SEAM_M: Final = 0.00025
"""A point 0.5 mm inside is then at most 0.016 mm nearer to the seam than it is told."""

_ON_SEAM_M: Final = 1e-6
_TURNS: Final = 400
"""Going to one surface and to the other, in turn, ends where both meet: slowly where they meet at a small angle."""

_BURIED_M: Final = 1e-9
_AT_ONCE: Final = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """The union of solid bodies.

    Attributes:
        parts: bodies that stand still, none of them a plane. The axes they stand in are the thing's. They overlap or lie
            apart; they do not touch face to face, where there is no seam.
    """

    parts: tuple[Body, ...]

    def signed_distance(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far points are from the surface.

        Args:
            points_m: (N, 3) in the thing's axes.

        Returns:
            (N,) m, negative inside.
        """
        points = np.ascontiguousarray(points_m, dtype=np.float64).T
        least = np.full(points.shape[1], np.inf)
        for part in self.parts:
            least = np.minimum(least, _nearest(part, points)[1])
        inside = np.flatnonzero(least < 0.0)
        if inside.size:
            least[inside] = -self._depth(points[:, inside])
        return least

    def surface(self, spacing_m: float = 0.001) -> SurfaceSamples:
        """Spread points over the surface."""
        found = []
        for index, part in enumerate(self.parts):
            own = samples_of(part.shape, spacing_m)
            turn, place = part.R_scene_body, np.asarray(part.position_m)[:, None]
            moved = SurfaceSamples(turn @ own.points + place, turn @ own.normals, own.areas_m2)
            # Where two parts touch face to face there is no surface, either: a little outside is the inside of the other.
            out = moved.points + 1e-7 * moved.normals
            found.append(moved.where(~self._is_in_another(out, index)))
        return SurfaceSamples(
            np.concatenate([each.points for each in found], axis=1),
            np.concatenate([each.normals for each in found], axis=1),
            np.concatenate([each.areas_m2 for each in found]),
        )

    @property
    def bounds_m(self) -> tuple[Vector, Vector]:
        """The lowest and the highest x, y, z of the surface, to about a tenth of a millimetre."""
        points = self.surface(0.0005).points
        low, high = points.min(axis=1).tolist(), points.max(axis=1).tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def volume_m3(self, step_m: float = 0.0005) -> float:
        """Return the volume, from the distances at the middles of cells.

        Args:
            step_m: a cell's side. Half a millimetre is exact to about a thousandth.
        """
        (low, high) = (np.asarray(each) for each in self.bounds_m)
        axes = [np.arange(start - step_m, end + 2 * step_m, step_m) for start, end in zip(low, high, strict=True)]
        x, y = (each.ravel() for each in np.meshgrid(axes[0], axes[1]))
        filled = 0.0
        for z in axes[2]:
            layer = np.stack([x, y, np.full_like(x, z)])
            least = np.min([_nearest(part, layer)[1] for part in self.parts], axis=0)
            filled += float(np.clip(0.5 - least / step_m, 0.0, 1.0).sum())
        return filled * step_m**3

    def _is_in_another(self, points: Points, but: int) -> NDArray[np.bool_]:
        inside = np.zeros(points.shape[1], dtype=np.bool_)
        for index, part in enumerate(self.parts):
            if index != but:
                inside |= _nearest(part, points)[1] < -_BURIED_M
        return inside

    def _depth(self, points: Points) -> NDArray[np.float64]:
        """Return how deep points inside lie, (N,) m."""
        best = np.full(points.shape[1], np.inf)
        for index, part in enumerate(self.parts):
            place = np.asarray(part.position_m)[:, None]
            for on_face in nearest_on_faces(part.shape, part.R_scene_body.T @ (points - place)):
                on_part = part.R_scene_body @ on_face + place
                is_surface = ~self._is_in_another(on_part, index)
                best = np.minimum(best, np.where(is_surface, np.linalg.norm(points - on_part, axis=0), np.inf))
        seams = _seams(self)
        for start in range(0, points.shape[1] if seams.size else 0, _AT_ONCE):
            some = points[:, start : start + _AT_ONCE]
            best[start : start + _AT_ONCE] = np.minimum(best[start : start + _AT_ONCE], _least_distance(some, seams))
        return best


@functools.lru_cache(maxsize=8)
def _seams(solid: Solid) -> Points:
    """Return points (3, N) of the curves in which the surfaces of two parts meet, unless a third one hides them."""
    found = [np.zeros((3, 0))]
    for index, part in enumerate(solid.parts):
        for beside, other in enumerate(solid.parts[:index]):
            met = _on_both(part, other, _samples_near(part, other))
            hidden = np.zeros(met.shape[1], dtype=np.bool_)
            for third, body in enumerate(solid.parts):
                if third not in {index, beside}:
                    hidden |= _nearest(body, met)[1] < -_ON_SEAM_M
            found.append(met[:, ~hidden])
    return np.concatenate(found, axis=1)


def _nearest(part: Body, points: Points) -> tuple[Points, NDArray[np.float64]]:
    """Return the nearest points of a part's surface, and the signed distances, in the thing's axes."""
    place = np.asarray(part.position_m)[:, None]
    found = nearest_on(part.shape, part.R_scene_body.T @ (points - place))
    moved: Points = part.R_scene_body @ found.points + place
    return moved, found.signed_m


def _samples_near(part: Body, other: Body) -> Points:
    """Return samples of a part's surface next to the other's."""
    own = part.R_scene_body @ samples_of(part.shape, _SEAM_M).points + np.asarray(part.position_m)[:, None]
    near: Points = own[:, np.abs(_nearest(other, own)[1]) < 2.0 * _SEAM_M]
    return near


def _on_both(part: Body, other: Body, points: Points) -> Points:
    """Return where points arrive that go to the nearest places of one surface and of the other, in turn; some never do."""
    arrived = [np.zeros((3, 0))]
    points = _nearest(other, points)[0]
    for _ in range(_TURNS):
        if not points.size:
            break
        on_part, signed = _nearest(part, points)
        there = np.abs(signed) < _ON_SEAM_M
        arrived.append(on_part[:, there])
        points = _nearest(other, on_part[:, ~there])[0]
    return np.concatenate(arrived, axis=1)


def _least_distance(points: Points, others: Points) -> NDArray[np.float64]:
    """Return the distance (N,) of points (3, N) to the nearest of others (3, M)."""
    least = np.full(points.shape[1], np.inf)
    for start in range(0, others.shape[1], _AT_ONCE):
        some = others[:, start : start + _AT_ONCE]
        square = (points**2).sum(axis=0)[:, None] + (some**2).sum(axis=0) - 2.0 * points.T @ some
        least = np.minimum(least, square.min(axis=1))
    distance: NDArray[np.float64] = np.sqrt(np.maximum(least, 0.0))
    return distance


_UP: Final = (0.0, 0.0, 1.0)


def _speckles(seed: int, light: tuple[float, float, float], dark: tuple[float, float, float]) -> Texture:
    """Return a texture with detail down to what a pixel of 0.4 mm can hold."""
    return Texture(seed=seed, light_bgr=light, dark_bgr=dark, contrast=0.8, shortest_m=0.0015, longest_m=0.025)


def _figure() -> Solid:
    """A head with a nose and an ear on a bell."""
    skin = _speckles(21, (0.42, 0.58, 0.78), (0.12, 0.22, 0.40))
    return Solid(
        (
            Body("bell", Frustum(0.038, 0.024, 0.052), (0.0, 0.0, 0.026), skin),
            Body("head", Sphere(0.029), (0.0, 0.0, 0.068), skin),
            Body("nose", Box((0.024, 0.014, 0.012)), (0.032, 0.0, 0.066), skin, rotation(_UP, 0.2)),
            Body("ear", Torus(0.013, 0.004), (-0.004, 0.031, 0.080), skin, rotation((0.0, 1.0, 0.0), math.pi / 2.0)),
        )
    )


def _wheel() -> Solid:
    """Three vanes of 3 mm and a ring of 6 mm on a shaft: what is thin is seen from both sides."""
    paint = _speckles(31, (0.66, 0.52, 0.24), (0.30, 0.20, 0.08))
    vanes = []
    for number in range(3):
        angle = 2.0 * math.pi * number / 3.0
        x, y = 0.026 * math.cos(angle), 0.026 * math.sin(angle)
        vanes.append(Body("vane", Box((0.044, 0.003, 0.052)), (x, y, 0.034), paint, rotation(_UP, angle)))
    return Solid(
        (
            Body("foot", Frustum(0.036, 0.032, 0.010), (0.0, 0.0, 0.005), paint),
            Body("shaft", Frustum(0.009, 0.008, 0.070), (0.0, 0.0, 0.040), paint),
            *vanes,
            Body("ring", Torus(0.016, 0.003), (0.0, 0.0, 0.091), paint, rotation((1.0, 0.0, 0.0), math.pi / 2.0)),
        )
    )


def _vase() -> Solid:
    """A glazed vase: the lamp is reflected in it, elsewhere for each camera."""
    glaze = Texture(
        seed=41,
        light_bgr=(0.55, 0.38, 0.22),
        dark_bgr=(0.22, 0.12, 0.06),
        contrast=0.55,
        shortest_m=0.003,
        longest_m=0.05,
        gloss=0.9,
        sharpness=50.0,
    )
    return Solid(
        (
            Body("foot", Frustum(0.030, 0.022, 0.016), (0.0, 0.0, 0.008), glaze),
            Body("belly", Sphere(0.036), (0.0, 0.0, 0.042), glaze),
            Body("neck", Frustum(0.020, 0.014, 0.034), (0.0, 0.0, 0.085), glaze),
        )
    )


def _house() -> Solid:
    """A tower house of plain plaster: nearly no texture."""
    plaster = Texture(
        seed=51,
        light_bgr=(0.60, 0.64, 0.66),
        dark_bgr=(0.50, 0.53, 0.55),
        contrast=0.10,
        shortest_m=0.002,
        longest_m=0.03,
    )
    return Solid(
        (
            Body("house", Box((0.070, 0.048, 0.046)), (0.0, 0.0, 0.023), plaster, rotation(_UP, 0.3)),
            Body("tower", Frustum(0.021, 0.021, 0.078), (0.020, 0.010, 0.039), plaster),
            Body("roof", Frustum(0.026, 0.0, 0.030), (0.020, 0.010, 0.089), plaster),
        )
    )


OBJECTS: Final[Mapping[str, Callable[[], Solid]]] = MappingProxyType(
    {"speckled": _figure, "thin": _wheel, "shiny": _vase, "plain": _house}
)
"""What can be scanned, by its name."""
