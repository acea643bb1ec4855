"""The field in the cells of a carved box: known near surfaces, +1 where cameras looked through, -1 where things hid the rest. Pure.

Cells of which nothing is known get what lies around them. So a hole that no view told anything of is closed by a smooth surface.

Source: J. Davis et al., "Filling holes in complex surfaces using volumetric diffusion", 2002.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import INSIDE, ONE, SIDE, Blocks
from phone_host.scan.box import Cells
from phone_host.scan.carving import Carving

Floats = NDArray[np.float32]
F: Final = np.float32

_SMOOTHINGS: Final = 4
"""Passes of (1, 2, 1): the edge between what was looked through and what was hidden is known to a cell only."""

_AT_ONCE: Final = 2048


@dataclass(frozen=True, slots=True, eq=False)
class CellField:
    """The field in cells.

    Attributes:
        cells: how they lie.
        values: (Z + 2, Y + 2, X + 2) float32, -1..1, with a cell more on each side.
    """

    cells: Cells
    values: Floats

    def at(self, voxels: NDArray[np.int64]) -> Floats:
        """Return the field (N,) float32 at numbers of voxels (N, 3) along x, y, z, between cells; those outside get the value of the nearest cell."""
        size, flat = np.array(self.values.shape[::-1]), self.values.ravel()
        wide = self.cells.voxels
        place = (voxels - (wide - 1) / 2) / wide - np.array(self.cells.low) + 1
        place = np.clip(place, 0, size - 1).astype(F)
        low = np.minimum(place.astype(np.int64), size - 2)
        share, strides = place - low, np.array([1, size[0], size[0] * size[1]])
        first = low @ strides
        if wide == 1:  # a voxel is a cell
            return np.asarray(flat[np.rint(place).astype(np.int64) @ strides], F)
        total = np.zeros(len(voxels), F)
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            parts = np.where(step == 1, share, F(1) - share)
            total += parts[:, 0] * parts[:, 1] * parts[:, 2] * flat[first + step @ strides]
        return total


def cell_field(carving: Carving, blocks: Blocks, least_weight: int, *, has_floor: bool) -> CellField:
    """Make the field of a box.

    Args:
        carving: what the views told of its cells.
        blocks: of the volume.
        least_weight: of a voxel that counts as seen.
        has_floor: whether its lowest layer goes on below it; else it ends there, as at the other sides.
    """
    cells, carved = carving.cells, carving.empty
    shape = carved.shape
    total, near, far = _seen(cells, blocks, least_weight)
    is_near = near.reshape(shape) > 0
    empty = ~is_near & (carved | (far.reshape(shape) > 0))
    hidden = ~is_near & ~empty & carving.hidden
    values = np.where(empty, F(1), np.where(hidden, F(-1), F(0)))
    values[is_near] = (total / np.maximum(near, 1)).reshape(shape)[is_near]
    values, is_known = np.pad(values, 1, constant_values=1), np.pad(is_near | empty | hidden, 1, constant_values=True)
    is_near = np.pad(is_near, 1)
    if has_floor:
        values[0], is_known[0] = values[1], is_known[1]
    values = _filled(values, is_known)
    near_values = values[is_near]
    for _ in range(_SMOOTHINGS):
        values = _smoothed(values)
        values[is_near] = near_values
    return CellField(cells, values)


def _seen(cells: Cells, blocks: Blocks, least_weight: int) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Return, for each cell, the sum of the field near surfaces, how many voxels that are, and how many are known to be empty."""
    wide, deep, tall = cells.counts
    count = wide * deep * tall
    total, near, far = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, np.int64)
    low = np.array(cells.low) * cells.voxels
    high = low + np.array(cells.counts) * cells.voxels
    first = SIDE * blocks.places[: blocks.count].astype(np.int64)
    inside = np.flatnonzero(((first + SIDE > low) & (first < high)).all(axis=1))
    for begin in range(0, len(inside), _AT_ONCE):
        numbers = inside[begin : begin + _AT_ONCE]
        known = blocks.weights[numbers] >= least_weight
        block, voxel = np.nonzero(known)
        place = (first[numbers[block]] + INSIDE[voxel]) // cells.voxels - np.array(cells.low)
        fits = ((place >= 0) & (place < np.array(cells.counts))).all(axis=1)
        cell = place[fits] @ np.array([1, wide, wide * deep])
        field = blocks.field[numbers[block[fits]], voxel[fits]]
        is_near = field < ONE
        total += np.bincount(cell[is_near], field[is_near] / ONE, minlength=count)
        near += np.bincount(cell[is_near], minlength=count)
        far += np.bincount(cell[~is_near], minlength=count)
    return total.astype(F), near, far


def _filled(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Give cells of which nothing is known the mean of what lies around them, as near as there is something."""
    if known.all():
        return values
    if not known.any():
        return np.ones_like(values)
    padded = [(0, size % 2) for size in values.shape]
    weight, total = np.pad(known.astype(F), padded), np.pad(np.where(known, values, F(0)), padded)
    for axis in range(3):
        weight, total = (_halved(each, axis) for each in (weight, total))
    coarse = _filled(np.where(weight > 0, total / np.maximum(weight, F(1)), F(0)), weight > 0)
    for _ in range(2):
        coarse = _smoothed(coarse)
    for axis, size in enumerate(values.shape):
        coarse = np.take(np.repeat(coarse, 2, axis=axis), np.arange(size), axis=axis)
    return np.where(known, values, coarse)


def _halved(values: Floats, axis: int) -> Floats:
    even, odd = (np.take(values, np.arange(first, values.shape[axis], 2), axis=axis) for first in (0, 1))
    return np.asarray(even + odd, F)


def _smoothed(values: Floats) -> Floats:
    """Filter by (1, 2, 1) along each axis; the border goes on beyond itself."""
    for axis in range(values.ndim):
        wide = np.pad(values, [(1, 1) if each == axis else (0, 0) for each in range(values.ndim)], mode="edge")
        low, high = (np.take(wide, np.arange(first, first + values.shape[axis]), axis=axis) for first in (0, 2))
        values = F(0.25) * (low + high) + F(0.5) * values
    return values
