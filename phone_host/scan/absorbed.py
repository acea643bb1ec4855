"""One field taken into another at a rigid motion: which blocks it reaches, and in numpy what the native library does (native/src/absorb.c). Pure.

Values are interpolated between the voxels of the one and averaged into the other, each by its weight. A field moves as a whole and is never warped.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import CORNERS, INSIDE, ONE, SIDE, Blocks
from phone_host.scan.volume_settings import MOST_WEIGHT

Floats = NDArray[np.float64]

_AT_ONCE: Final = 64
"""Blocks that are computed together: some 10 MB."""

_LOOKS: Final = np.linspace(-0.5, SIDE - 0.5, 6)
"""Places along an axis of a block, voxels, that tell which blocks it comes to lie in: at most 1.6 voxels apart."""

_NEXT_TO_NOTHING: Final = 1e-4
"""A corner with so little share may be unknown: a motion that moves nothing leaves everything as it was."""


def reached(places: NDArray[np.int32], into_of: SE3, voxel_m: float) -> NDArray[np.int32]:
    """Return the blocks (M, 3) in which moved blocks (N, 3) come to lie, in rising order."""
    looks = np.stack(np.meshgrid(_LOOKS, _LOOKS, _LOOKS, indexing="ij"), axis=-1).reshape(-1, 3) @ into_of.R.T
    found = [np.zeros((0, 3), np.int32)]
    for first in range(0, len(places), _AT_ONCE):
        corners = into_of.apply(SIDE * places[first : first + _AT_ONCE].astype(np.float64) * voxel_m) / voxel_m
        at = np.rint(corners[:, np.newaxis] + looks).astype(np.int32) >> 3
        found.append(np.unique(at.reshape(-1, 3), axis=0))
    return np.unique(np.concatenate(found), axis=0)


def absorbed(into: Blocks, of: Blocks, chosen: NDArray[np.uint8], rows: Floats) -> NDArray[np.uint8]:
    """Average a moved field into blocks.

    Args:
        into: whose values change.
        of: the field that moves.
        chosen: (count,) 1 for each block of `into` that is looked at.
        rows: (3, 4) takes voxels of `into` to voxels of `of`.

    Returns:
        (count,) 1 for each block that got something.
    """
    changed, numbers = np.zeros_like(chosen), np.flatnonzero(chosen)
    for first in range(0, len(numbers), _AT_ONCE):
        some = numbers[first : first + _AT_ONCE]
        voxels = (SIDE * into.places[some][:, np.newaxis].astype(np.float64) + INSIDE).reshape(-1, 3)
        at = voxels @ rows[:, :3].T + rows[:, 3]
        field, weight, tint, tinted, known = _sampled(of, at)
        changed[some] = known.reshape(len(some), -1).any(axis=1)
        block, voxel = (each.ravel()[known] for each in np.broadcast_arrays(some[:, np.newaxis], np.arange(SIDE**3)))
        held, before = into.weights[block, voxel].astype(np.float64), into.field[block, voxel].astype(np.float64)
        coming, value = np.maximum(np.rint(weight[known]), 1), np.rint(field[known])
        mean = np.rint((before * held + np.where(value == 0, 1, value) * coming) / (held + coming))
        into.field[block, voxel] = np.where(mean == 0, 1, mean)
        into.weights[block, voxel] = np.minimum(held + coming, MOST_WEIGHT)
        mine, theirs = held * (np.abs(before) < ONE), coming * (tinted[known] > 0)
        share = tinted[known][:, np.newaxis]  # also next to nothing of a colour is that colour
        other = tint[known] / np.where(share > 0, share, 1)
        old, told = into.colours[block, voxel], mine + theirs > 0
        both = np.where(told, mine + theirs, 1)[:, np.newaxis]
        mixed = np.rint((old * mine[:, np.newaxis] + other * theirs[:, np.newaxis]) / both)
        into.colours[block, voxel] = np.where(told[:, np.newaxis], mixed, old)
    return changed


def _sampled(of: Blocks, at: Floats) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return what a field holds at places (N, 3), voxels: value, weight, colour (N, 3) and its share, and whether all around is known."""
    low = np.floor(at).astype(np.int64)
    share, count = at - low, len(at)
    field, weight, tint, tinted = np.zeros(count), np.zeros(count), np.zeros((count, 3)), np.zeros(count)
    known = np.ones(count, np.bool_)
    for corner in CORNERS:
        by = np.where(corner, share, 1 - share).prod(axis=1)
        numbers, inside = of.locate(low + corner)
        held = np.where(numbers >= 0, of.weights[numbers, inside], 0)
        known &= (held > 0) | (by < _NEXT_TO_NOTHING)
        by = np.where(held > 0, by, 0)
        value = of.field[numbers, inside].astype(np.float64)
        field += by * value
        weight += by * held
        near = by * (np.abs(value) < ONE)  # elsewhere no colour was told
        tint += near[:, np.newaxis] * of.colours[numbers, inside]
        tinted += near
    return field, weight, tint, tinted, known
