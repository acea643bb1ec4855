"""Blocks with the voxels around them, to filter a field where blocks meet. Pure."""

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import SIDE, Blocks

_STEPS: Final = tuple(product((-1, 0, 1), repeat=3))


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Voxels of N cubes whose sides are S, [z, y, x].

    Attributes:
        field: (N, S, S, S) int16, as in `Blocks`.
        weights: (N, S, S, S) uint16; 0 where there is no block.
    """

    field: NDArray[np.int16]
    weights: NDArray[np.uint16]


def windows_of(blocks: Blocks, places: NDArray[np.int32], around: int) -> Windows:
    """Return the voxels of some blocks and those around them.

    Args:
        blocks: of a volume.
        places: (N, 3) of the blocks; they need not be there.
        around: how many voxels on each side, 1..8.
    """
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
    return Windows(field, weights)
