"""Polygons become triangles that cover them once, whatever their shape, by areas that geometry gives."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from phone_host.output.meshes.polygons import MAX_CONCAVE, TooManyCornersError, triangulate

_L = np.array([(0, 40, 0), (0, 0, 0), (40, 0, 0), (40, 10, 0), (10, 10, 0), (10, 40, 0)], np.float64)


def areas(points: NDArray[np.float64], triangles: NDArray[np.integer[Any]]) -> NDArray[np.float64]:
    """Signed areas along z."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.asarray(np.cross(b - a, c - a)[:, 2] / 2)


def whole(points: NDArray[np.float64]) -> float:
    """Area of a polygon, by the shoelace formula."""
    x, y = points[:, 0], points[:, 1]
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


@given(radii=st.lists(st.floats(0.2, 3), min_size=4, max_size=24), first=st.integers(0, 23), turn=st.floats(0, 6))
def test_a_star_is_covered_once(radii: list[float], first: int, turn: float) -> None:
    """No triangle is turned over, and together they have the polygon's area: so they cover it, and nothing else."""
    angle = turn + 2 * np.pi * np.arange(len(radii)) / len(radii)
    points = np.roll(np.stack([radii * np.cos(angle), radii * np.sin(angle), 0 * angle], axis=1), first, axis=0)
    made = areas(points, triangulate(points, np.array([len(radii)]), np.arange(len(radii))))
    assert len(made) == len(radii) - 2
    assert made.min() >= -1e-12
    assert made.sum() == pytest.approx(whole(points), rel=1e-9)


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("turn", [1, -1])
def test_a_hollow_face_is_cut_from_any_corner_and_keeps_its_way_round(first: int, turn: int) -> None:
    """An L of 700 mm2: turned over, its triangles are, too."""
    points = np.roll(_L, first, axis=0)[::turn]
    made = areas(points, triangulate(points, np.array([6]), np.arange(6)))
    assert (turn * made > 0).all()
    assert turn * made.sum() == pytest.approx(700)


def test_polygons_of_all_sizes_stay_in_their_order() -> None:
    """A triangle, an L, a line, a square, a comb: as many triangles as corners less two, each polygon's behind those of the one before."""
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float64)
    teeth = [(x, (5 if step else 0), 0) for x in range(30, 0, -1) for step in (1, 0)]
    comb = np.array([(0, -1, 0), (31, -1, 0), *[(x + 0.5 * (y == 0), y, z) for x, y, z in teeth]], np.float64)
    parts = [square[:3], _L, square[:2], square, comb]
    counts = np.array([len(part) for part in parts])
    points = np.concatenate(parts)
    triangles = triangulate(points, counts, np.arange(len(points)))
    made = np.split(areas(points, triangles), np.cumsum(np.maximum(counts - 2, 0))[:-1])
    for part, each in zip(parts, made, strict=True):
        assert each.sum() == pytest.approx(whole(part))
        assert (each >= 0).all()


def test_corners_on_a_line_give_no_flat_triangles() -> None:
    """A square with a point in the middle of each side: no triangle has no area, so that neighbours still fit."""
    square = np.array([(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)], np.float64)
    points = np.hstack([square, np.zeros((8, 1))])
    for first in range(8):
        turned = np.roll(points, first, axis=0)
        made = areas(turned, triangulate(turned, np.array([8]), np.arange(8)))
        assert made.min() > 0.4
        assert made.sum() == pytest.approx(4)


def test_a_round_face_may_have_any_number_of_corners_a_hollow_one_not() -> None:
    """Clipping takes the cube of their number, so it has an end; what crosses itself still gives triangles."""
    count = 2 * MAX_CONCAVE + 2
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert len(triangulate(ring, np.array([count]), np.arange(count))) == count - 2
    star = ring * (1 - 0.5 * (np.arange(count)[:, None] % 2))
    with pytest.raises(TooManyCornersError):
        triangulate(star, np.array([count]), np.arange(count))
    crossed = np.array([(0, 0, 0), (2, 0, 0), (0, 1, 0), (2, 1, 0), (1, 3, 0)], np.float64)
    assert triangulate(crossed, np.array([5]), np.arange(5)).shape == (3, 3)
    assert triangulate(crossed, np.array([2, 0]), np.arange(2)).shape == (0, 3)
    assert triangulate(crossed, np.zeros(0, np.int64), np.arange(0)).shape == (0, 3)
