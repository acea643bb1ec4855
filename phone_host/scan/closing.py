"""A volume's field with all that its box holds: what nobody saw is inside where something hid it. So the surface has no holes. Pure.

Near a surface that was seen the field is what the views measured. Elsewhere it is that of the carved cells. Outside the box and below its floor
there is nothing. The blocks around the surface are made one after another, from those where it is known to pass on to their neighbours, until
it ends nowhere; what is far from it is never made.

The field of the carved cells is known near surfaces, +1 where cameras looked through, -1 where things hid the rest. Cells of which nothing is known get
what lies around them. So a hole that no view told anything of is closed by a smooth surface.

Source: J. Davis et al., "Filling holes in complex surfaces using volumetric diffusion", 2002.
"""

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import INSIDE, ONE, SIDE, Blocks, Box, Cells
from phone_host.scan.carving import Carving
from phone_host.scan.ground import Ground
from phone_host.scan.volume_settings import LEAST_WEIGHT, VolumeSettings

Floats = NDArray[np.float32]
F: Final = np.float32

_SMOOTHINGS: Final = 4
"""Passes of (1, 2, 1): the edge between what was looked through and what was hidden is known to a cell only."""

_BLOCKS_AT_ONCE: Final = 2048


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
    for begin in range(0, len(inside), _BLOCKS_AT_ONCE):
        numbers = inside[begin : begin + _BLOCKS_AT_ONCE]
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


Places = NDArray[np.int32]

_STEPS: Final = tuple(product((-1, 0, 1), repeat=3))


def _with_around(
    blocks: Blocks, places: NDArray[np.int32], around: int
) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
    """Return field and weights of blocks at places (N, 3), which need not be there, with 1..8 voxels more on each side, (N, S, S, S) z, y, x each; weight 0 where there is no block."""
    size = SIDE + 2 * around
    field = np.zeros((len(places), size, size, size), np.int16)
    weights = np.zeros(field.shape, np.uint16)
    into = {-1: slice(0, around), 0: slice(around, around + SIDE), 1: slice(around + SIDE, size)}
    out_of = {-1: slice(SIDE - around, SIDE), 0: slice(0, SIDE), 1: slice(0, around)}
    cube = (-1, SIDE, SIDE, SIDE)
    for x, y, z in _STEPS:
        numbers = blocks.find(places + np.array([x, y, z], np.int32))
        has = np.flatnonzero(numbers >= 0)
        there = numbers[has]
        target, source = (has, into[z], into[y], into[x]), (slice(None), out_of[z], out_of[y], out_of[x])
        field[target] = blocks.field[there].reshape(cube)[source]
        weights[target] = blocks.weights[there].reshape(cube)[source]
    return field, weights


_AT_ONCE: Final = 512
_SIZE: Final = SIDE + 2
_NOT_SEEN: Final = 1
_SOFT: Final = F(4)
"""Weight of what was not measured, where a known value is smoothed with it."""


@dataclass(frozen=True, slots=True)
class Floor:
    """A plane that a thing stands on; z is up.

    Attributes:
        z_m: its height, m.
        skip_m: height above it, m, in which its own surface and that of the thing cannot be told apart; what stands there goes on down to it.
        is_printed: whether it is a printed mat.
    """

    z_m: float = 0.0
    skip_m: float = 0.0
    is_printed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Some blocks with a voxel more on each side, [z, y, x]; weights are those of the volume, 1 where nobody saw a surface."""

    field: Floats
    weights: NDArray[np.uint16]


class _Closed:
    """The closed field, block by block.

    Attributes:
        low_m: lowest corner of what is not outside.
    """

    def __init__(
        self,
        blocks: Blocks,
        settings: VolumeSettings,
        cells: CellField,
        box: Box,
        floor: Floor | Ground | None,
    ) -> None:
        self._blocks, self._cells = blocks, cells
        self._ground = floor if isinstance(floor, Ground) else None
        floor = None if isinstance(floor, Ground) else floor
        self._voxel_m, self._truncation_m = settings.voxel_m, settings.truncation_m
        x_m, y_m, z_m = box.low_m
        if floor and z_m <= floor.z_m + floor.skip_m:
            z_m = floor.z_m
        self.low_m = x_m, y_m, z_m
        self._high_m, self._foot = box.high_m, None
        if floor and floor.skip_m:
            self._foot = int(np.ceil((floor.z_m + floor.skip_m) / settings.voxel_m))

    def part(self, places: Places) -> _Part:
        """Return the field of blocks at places (N, 3)."""
        raw = self._uncut(places)
        field, weights = raw.field, raw.weights
        if self._foot is not None:
            beneath = np.flatnonzero(SIDE * places[:, 2] - 1 < self._foot)
            above = places[beneath].copy()
            above[:, 2] = self._foot // SIDE
            foot = self._uncut(above).field[:, self._foot % SIDE + 1]
            heights = SIDE * places[beneath, 2, np.newaxis] - 1 + np.arange(_SIZE)
            low = heights < self._foot
            field[beneath] = np.where(low[..., np.newaxis, np.newaxis], foot[:, np.newaxis], field[beneath])
            weights[beneath] = np.where(low[..., np.newaxis, np.newaxis], np.uint16(_NOT_SEEN), weights[beneath])
        outside = self._outside(places)
        is_cut = outside > field
        return _Part(np.where(is_cut, outside, field), np.where(is_cut, np.uint16(_NOT_SEEN), weights))

    def _uncut(self, places: Places) -> _Part:
        known, weights = _with_around(self._blocks, places, 2)
        near = (weights >= LEAST_WEIGHT) & (known < ONE)
        field = known.astype(F) / F(ONE)
        block, z, y, x = np.nonzero(~near)
        voxels = SIDE * places[block].astype(np.int64) + np.column_stack([x, y, z]) - 2
        field[block, z, y, x] = self._cells.at(voxels)
        trust = np.where(near, np.minimum(weights, 64).astype(F), _SOFT)
        smooth = _summed(field * trust) / _summed(trust)
        inner = np.s_[:, 1:-1, 1:-1, 1:-1]
        return _Part(smooth, np.where(near[inner], weights[inner], np.uint16(_NOT_SEEN)))

    def _outside(self, places: Places) -> Floats:
        """Return how far voxels lie outside the box, in truncations; inside it is below 0. (N, 10, 10, 10)."""
        first = SIDE * places.astype(np.int64) - 1
        x, y, z = (first[:, axis, np.newaxis] + np.arange(_SIZE) for axis in range(3))
        far = [
            np.maximum(low_m - at * self._voxel_m, at * self._voxel_m - high_m)
            for at, low_m, high_m in zip((x, y, z), self.low_m, self._high_m, strict=True)
        ]
        most = np.maximum(np.maximum(far[0][:, np.newaxis, np.newaxis], far[1][:, np.newaxis, :, np.newaxis]), far[2][:, :, np.newaxis, np.newaxis])  # fmt: skip
        if self._ground is not None:
            most = np.maximum(most, -self._ground.heights_m((x, y, z), self._voxel_m))
        most = most / self._truncation_m
        return np.asarray(np.clip(most, -1, 1), F)


def _summed(values: Floats) -> Floats:
    """Filter by (1, 2, 1) along each axis, without a border: each side is two shorter."""
    for axis in (1, 2, 3):
        parts = [np.take(values, np.arange(first, values.shape[axis] - 2 + first), axis=axis) for first in range(3)]
        values = F(0.25) * (parts[0] + parts[2]) + F(0.5) * parts[1]
    return values


def closed(
    blocks: Blocks, settings: VolumeSettings, carving: Carving, box: Box, floor: Floor | Ground | None
) -> Blocks:
    """Close a volume's field: return blocks around a surface without holes.

    Weights are those of the volume where the surface was seen, else 1; there are no colours but where the volume has some.
    """
    cells = cell_field(carving, blocks, LEAST_WEIGHT, has_floor=isinstance(floor, Floor))
    field = _Closed(blocks, settings, cells, box, floor)
    made, waiting = Blocks(), _begin(blocks, cells, field.low_m, box)
    steps = np.array(_STEPS, np.int32)
    while len(waiting):
        active = []
        for first in range(0, len(waiting), _AT_ONCE):
            places = waiting[first : first + _AT_ONCE]
            part = field.part(places)
            below = (part.field < 0).reshape(len(places), -1)
            active.append(places[below.any(axis=1) & ~below.all(axis=1)])
            made = _with(made, places, part, blocks)
        around = np.unique((np.concatenate(active)[:, np.newaxis] + steps).reshape(-1, 3), axis=0)
        waiting = around[made.find(around) < 0]
    return made


def _begin(blocks: Blocks, cells: CellField, low_m: tuple[float, float, float], box: Box) -> Places:
    """Return the blocks in the box that the volume has, and those where the cells' field changes its sign, or is below 0 on the floor."""
    values, wide = cells.values, cells.cells.voxels
    below, found = values < 0, []
    for axis in range(3):
        changes = np.argwhere(np.diff(below, axis=axis))[:, ::-1]
        found.append((changes - 1 + np.array(cells.cells.low)) * wide // SIDE)
    floor = np.argwhere(below[1])[:, ::-1]
    found.append(
        (np.column_stack([floor, np.ones(len(floor), np.int64)]) - 1 + np.array(cells.cells.low)) * wide // SIDE
    )
    places = blocks.places[: blocks.count]
    side_m = SIDE * cells.cells.voxel_m
    inside = (places * side_m < np.array(box.high_m)) & ((places + 1) * side_m > np.array(low_m))
    found.append(places[inside.all(axis=1)])
    return np.unique(np.concatenate(found).astype(np.int32), axis=0)


def _with(made: Blocks, places: Places, part: _Part, blocks: Blocks) -> Blocks:
    """Return the blocks with some more."""
    count = made.count
    if count + len(places) > made.room:
        made = made.grown(max(2 * made.room, count + len(places)))
    made.add(places)
    numbers, inner = slice(count, count + len(places)), np.s_[:, 1:-1, 1:-1, 1:-1]
    field = np.rint(part.field[inner] * ONE).astype(np.int16).reshape(len(places), -1)
    made.field[numbers] = np.where(field == 0, np.int16(1), field)
    made.weights[numbers] = part.weights[inner].reshape(len(places), -1)
    there = blocks.find(places)
    has = there >= 0
    made.colours[count : count + len(places)][has] = blocks.colours[there[has]]
    return made
