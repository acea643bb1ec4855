"""The part of a surface that no view measured: its share, its colours from the border, and the surface without it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.geometry.unseen_surface import (
    PINK_RGB,
    apply_unseen,
    filled_from_border,
    unseen_share,
)
from phone_host.model import UnseenSurface

SIDE = 21


def grid() -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points and triangles of a square of 20 x 20 cells, 1 m each."""
    rows, columns = np.mgrid[0:SIDE, 0:SIDE]
    points = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(SIDE**2)]).astype(np.float32)
    corner = np.arange(SIDE**2).reshape(SIDE, SIDE)[:-1, :-1].ravel()
    halves = [
        np.column_stack([corner, corner + 1, corner + SIDE]),
        np.column_stack([corner + 1, corner + SIDE + 1, corner + SIDE]),
    ]
    return points, np.concatenate(halves).astype(np.int32)


def test_unseen_points_take_colours_between_those_of_the_border() -> None:
    """Between a dark left and a bright right column, brightness rises steadily; seen colours stay, and what unseen points had before does not matter."""
    points, triangles = grid()
    seen = (points[:, 0] == 0) | (points[:, 0] == SIDE - 1)
    colours = np.where(points[:, :1] == 0, np.uint8(40), np.uint8(200)) * np.ones((1, 3), np.uint8)
    filled = filled_from_border(colours, triangles, seen)
    levels = filled[:, 0].reshape(SIDE, SIDE).astype(int)
    assert (np.diff(levels, axis=1) >= 0).all()
    assert levels.mean() == pytest.approx(120, abs=2)
    assert np.array_equal(filled[seen], colours[seen])
    other = np.where(seen[:, np.newaxis], colours, np.uint8(7)).astype(np.uint8)
    assert np.array_equal(filled_from_border(other, triangles, seen), filled)
    assert np.array_equal(filled_from_border(filled, triangles, seen), filled)


def test_a_part_without_a_border_takes_the_mean() -> None:
    """A second square of which nothing was seen has the mean of what was seen; where nothing at all was seen, all is grey."""
    points, triangles = grid()
    both = np.concatenate([triangles, triangles + len(points)])
    colours = np.tile(np.array([[10, 90, 30]], np.uint8), (2 * len(points), 1))
    colours[: len(points) // 2] = (30, 110, 50)
    seen = np.arange(len(colours)) < len(points)
    far = filled_from_border(colours, both, seen)[len(points) :]
    assert np.abs(far.astype(float) - [20, 100, 40]).max() <= 1
    assert (filled_from_border(colours, both, np.zeros(len(colours), np.bool_)) == 128).all()
    assert filled_from_border(colours, both, np.ones(len(colours), np.bool_)) is colours


def test_share_pink_and_cut_go_by_the_flags() -> None:
    """With the lower half unseen, half of the area is; pink covers its points only; a triangle remains if all of its corners were seen."""
    points, triangles = grid()
    seen = points[:, 1] >= SIDE // 2
    assert unseen_share(points, triangles, seen) == pytest.approx(0.5, abs=0.03)
    assert np.isnan(unseen_share(points[:0], triangles[:0], seen[:0]))
    colours = np.full((len(points), 3), 99, np.uint8)
    pink, remains = apply_unseen(colours, triangles, seen, UnseenSurface.PINK)
    assert remains.all()
    assert (pink[~seen] == PINK_RGB).all()
    assert (pink[seen] == 99).all()
    same, remains = apply_unseen(colours, triangles, seen, UnseenSurface.CUT)
    assert np.array_equal(same, colours)
    rest = triangles[remains]
    assert len(rest) == len(triangles) // 2
    assert points[rest, 1].min() == SIDE // 2


@pytest.mark.parametrize("choice", [UnseenSurface.FILL, UnseenSurface.PINK])
def test_points_without_colours_stay_without(choice: UnseenSurface) -> None:
    """A surface without colours gets none, and loses no triangle, where its unseen part is filled in."""
    points, triangles = grid()
    none = np.zeros((0, 3), np.uint8)
    colours, remains = apply_unseen(none, triangles, points[:, 1] >= SIDE // 2, choice)
    assert colours is none
    assert remains.all()
