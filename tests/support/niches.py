"""Views of two niches that look alike, 2 m apart in a long wall without any paper, with exact depth."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.view import View
from tests.support.plane_films import Plane, nearest_view, plane_at, plane_view, texture

APART_M: Final = 2.0
_WALL_M: Final = 1.1
_HALF_M: Final = 0.2
BARE: Final = np.full((800, 800), 128, np.uint8)
_PAPERS: Final = tuple(texture(seed) for seed in (41, 42, 43))


def _walls() -> tuple[Plane, ...]:
    """The wall, left of the niches, between them, and right of them."""
    ends = (-4.0, -_HALF_M), (_HALF_M, APART_M - _HALF_M), (APART_M + _HALF_M, 6.0)
    return tuple(
        replace(plane_at([(left + right) / 2, 0.0, _WALL_M], [0.0, 0.0, 0.0]), half_m=((right - left) / 2, 3.0))
        for left, right in ends
    )


def _niche(x_m: float) -> tuple[Plane, ...]:
    """Two papered walls that meet behind the wall, and a piece of the floor."""
    quarter, middle_m = np.pi / 4, _WALL_M + _HALF_M / 2
    side = (_HALF_M / np.sqrt(2), 3.0)
    return (
        replace(plane_at([x_m - _HALF_M / 2, 0.0, middle_m], [0.0, -quarter, 0.0]), half_m=side),
        replace(plane_at([x_m + _HALF_M / 2, 0.0, middle_m], [0.0, quarter, 0.0]), half_m=side),
        replace(plane_at([x_m, 0.12, middle_m], [np.pi / 2, 0.0, 0.0]), half_m=(_HALF_M, _HALF_M / 2)),
    )


def station(x_m: float) -> SE3:
    """Return the pose of a camera before the wall, 0.5 m away, that looks at it."""
    return SE3(np.eye(3), np.array([x_m, 0.0, _WALL_M - 0.5]))


def niches_view(world_camera: SE3, wall: NDArray[np.uint8] = BARE) -> View:
    """What the camera sees; `wall`: the paper on the wall between the niches."""
    shown = [(plane, wall) for plane in _walls()]
    shown += [each for x_m in (0.0, APART_M) for each in zip(_niche(x_m), _PAPERS, strict=True)]
    return nearest_view([plane_view(world_camera, paper, (plane,)) for plane, paper in shown])
