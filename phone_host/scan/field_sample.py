"""The field of a volume between its voxels. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import ONE, SIDE, Blocks
from phone_host.scan.cube_cases import CORNERS

Floats = NDArray[np.float64]

_ROW: Final = np.array([1, SIDE, SIDE**2])
_LEAST_KNOWN: Final = 0.5
"""Of a point's surroundings; with all of them, fields that only just meet would not."""


@dataclass(frozen=True, slots=True, eq=False)
class Sampled:
    """A field at some points.

    Attributes:
        values: (N,) -1 to 1, in truncations, positive before the surface; NaN where less than half of the surroundings are known.
        weights: (N,) of what was seen there; 0 where it is not known.
        colours: (N, 3) BGR, 0 to 255.
    """

    values: Floats
    weights: Floats
    colours: Floats


def sampled(blocks: Blocks, voxel_m: float, points_m: Floats, least_weight: int) -> Sampled:
    """Look up a field.

    Args:
        blocks: of the volume.
        voxel_m: distance of two values, m.
        points_m: (N, 3) in the world, m.
        least_weight: of a voxel that counts as known.
    """
    places = points_m / voxel_m
    lowest = np.floor(places)
    share, lowest = places - lowest, lowest.astype(np.int64)
    count = len(points_m)
    values, weights, colours, known = np.zeros(count), np.zeros(count), np.zeros((count, 3)), np.zeros(count)
    for corner in CORNERS:
        voxels = lowest + corner
        numbers = blocks.find((voxels >> 3).astype(np.int32))
        at = (voxels & (SIDE - 1)) @ _ROW
        there = np.maximum(numbers, 0)
        weight = np.where(numbers >= 0, blocks.weights[there, at], 0)
        part = np.where(corner > 0, share, 1 - share).prod(axis=1) * (weight >= least_weight)
        known += part
        values += part * blocks.field[there, at]
        weights += part * weight
        colours += part[:, np.newaxis] * blocks.colours[there, at]
    enough, divisor = known >= _LEAST_KNOWN, np.maximum(known, _LEAST_KNOWN)
    return Sampled(
        np.where(enough, values / (ONE * divisor), np.nan),
        np.where(enough, weights / divisor, 0.0),
        colours / divisor[:, np.newaxis],
    )


def slopes(blocks: Blocks, voxel_m: float, points_m: Floats, least_weight: int) -> Floats:
    """Return the direction (N, 3) in which the field rises, of length 1: out of the surface; NaN where it is not known."""
    rise = np.empty((len(points_m), 3))
    for axis in range(3):
        step = np.eye(3)[axis] * voxel_m
        after, before = (sampled(blocks, voxel_m, points_m + sign * step, least_weight).values for sign in (0.7, -0.7))
        rise[:, axis] = after - before
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(rise / np.linalg.norm(rise, axis=1, keepdims=True), np.float64)
