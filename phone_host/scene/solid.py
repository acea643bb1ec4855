"""A thing made of solids that touch or overlap: its surface, the distance to it, its volume. Pure.

Outside, the distance to a union is the least of the distances to its parts. Inside it is not: a part's surface that lies
within another part is no surface of the thing. There the nearest points that are buried are replaced by points of the
seams, in which two parts meet; these lie on the seam exactly and `_SEAM_M` apart along it.
"""

import functools
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scene.distance import Points, nearest_on, nearest_on_faces
from phone_host.scene.scene_model import Body, Vector
from phone_host.scene.surface_samples import SurfaceSamples, samples_of

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
