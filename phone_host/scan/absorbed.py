"""One field taken into another at a rigid motion. Pure.

Values are interpolated between the voxels of the one and averaged into the other, each by its weight. A field is never warped: what lies at a step of
the motion from where it was keeps its shape.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import ONE, SIDE, VOXELS, Blocks
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import MOST_WEIGHT

Floats = NDArray[np.float32]
Numbers = NDArray[np.int64]

_AT_ONCE: Final = 64
"""Blocks that are computed together: some 10 MB."""

_LOOKS: Final = np.linspace(-0.5, SIDE - 0.5, 6)
"""Places along an axis of a block, voxels, that tell which blocks it comes to lie in: at most 1.6 voxels apart."""

_CORNERS: Final = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.int64)
_INSIDE: Final = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
"""(512, 3) x, y, z of a block's voxels, in the order of its values."""


def absorb(into: Volume, of: Volume, into_of: SE3) -> None:
    """Take a field into another.

    Args:
        into: grows, as far as it has memory.
        of: stays as it is; its voxels are as wide.
        into_of: takes its points to the other's.
    """
    source, voxel_m = of.blocks, of.settings.voxel_m
    if source.count == 0:
        return
    places = _reached(source.places[: source.count], into_of, voxel_m)
    back = into_of.inverse()
    for first in range(0, len(places), _AT_ONCE):
        some = places[first : first + _AT_ONCE]
        values = _moved(source, some, back, voxel_m)
        seen = values.weights.any(axis=1)
        if seen.any():
            chosen = BlockValues(some[seen], values.field[seen], values.weights[seen], values.colours[seen])
            into.put(_averaged(into.blocks, chosen))


def _reached(places: NDArray[np.int32], into_of: SE3, voxel_m: float) -> NDArray[np.int32]:
    """Return the blocks (N, 3) in which moved blocks come to lie, in rising order."""
    looks = np.stack(np.meshgrid(_LOOKS, _LOOKS, _LOOKS, indexing="ij"), axis=-1).reshape(-1, 3)
    turned = looks @ into_of.R.T
    found: list[NDArray[np.int32]] = []
    for first in range(0, len(places), _AT_ONCE):
        corners = into_of.apply(SIDE * places[first : first + _AT_ONCE].astype(np.float64) * voxel_m) / voxel_m
        at = np.rint(corners[:, np.newaxis] + turned).astype(np.int32) >> 3
        found.append(np.unique(at.reshape(-1, 3), axis=0))
    return np.unique(np.concatenate(found), axis=0)


def _moved(source: Blocks, places: NDArray[np.int32], back: SE3, voxel_m: float) -> BlockValues:
    """Return what a moved field holds in blocks; a voxel is known where all eight around it are."""
    voxels = (SIDE * places[:, np.newaxis].astype(np.int64) + _INSIDE).reshape(-1, 3)
    at = back.apply(voxels * voxel_m) / voxel_m
    low = np.floor(at).astype(np.int64)
    share = (at - low).astype(np.float32)
    count = len(voxels)
    field, tint, tinted = np.zeros(count, np.float32), np.zeros((count, 3), np.float32), np.zeros(count, np.float32)
    weight, known = np.zeros(count, np.float32), np.ones(count, np.bool_)
    for corner in _CORNERS:
        by = np.where(corner, share, 1 - share).prod(axis=1)
        there = low + corner
        numbers = source.find((there >> 3).astype(np.int32))
        inside = (there & (SIDE - 1)) @ np.array([1, SIDE, SIDE**2])
        held = np.where(numbers >= 0, source.weights[numbers, inside], 0).astype(np.float32)
        known &= (held > 0) | (by < _NEXT_TO_NOTHING)
        field += by * source.field[numbers, inside]
        weight += by * held
        # Colours are told only near the surface; elsewhere they are black.
        near = by * (np.abs(source.field[numbers, inside].astype(np.int32)) < ONE) * (held > 0)
        tint += near[:, np.newaxis] * source.colours[numbers, inside]
        tinted += near
    colours = np.rint(tint / np.maximum(tinted, _NEXT_TO_NOTHING)[:, np.newaxis])
    rounded = np.rint(field).astype(np.int16)
    shape = (len(places), VOXELS)
    return BlockValues(
        places,
        np.where(known, np.where(rounded == 0, np.int16(1), rounded), np.int16(ONE)).reshape(shape),
        np.where(known, np.maximum(np.rint(weight), 1), 0).astype(np.uint16).reshape(shape),
        np.where(known[:, np.newaxis], colours, 0).astype(np.uint8).reshape(*shape, 3),
    )


_NEXT_TO_NOTHING: Final = np.float32(1e-4)
"""A corner with so little share may be unknown: a motion that moves nothing leaves everything as it was."""


def _averaged(into: Blocks, values: BlockValues) -> BlockValues:
    """Return the average of what blocks hold already and what comes in."""
    numbers = into.find(values.places)
    there = (numbers >= 0)[:, np.newaxis]
    held = np.where(there, into.weights[numbers], 0).astype(np.int64)
    coming, total = values.weights.astype(np.int64), np.maximum(held + values.weights, 1)
    mean = np.rint((into.field[numbers] * held + values.field * coming) / total).astype(np.int16)
    mean = np.where(held + coming > 0, np.where(mean == 0, np.int16(1), mean), np.int16(ONE))
    # A colour counts where it was told.
    mine = held * (np.abs(into.field[numbers].astype(np.int32)) < ONE)
    theirs = coming * (np.abs(values.field.astype(np.int32)) < ONE)
    both = np.maximum(mine + theirs, 1)[..., np.newaxis]
    tint = (into.colours[numbers] * mine[..., np.newaxis] + values.colours * theirs[..., np.newaxis]) / both
    weights = np.minimum(held + coming, MOST_WEIGHT).astype(np.uint16)
    return BlockValues(values.places, mean, weights, np.rint(tint).astype(np.uint8))
