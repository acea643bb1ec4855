"""The field of a volume between its voxels, and two fields of one thing put together. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import CORNERS, INSIDE, ONE, SIDE, Blocks
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import MOST_WEIGHT

Floats = NDArray[np.float64]

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
        numbers, at = blocks.locate(lowest + corner)
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


_AT_ONCE: Final = 64


def merged(first: Volume, second: Volume, first_second: SE3, threads: int = 1) -> Volume:
    """Put two volumes together: what either has seen; where both have, the mean by their weights. The axes and voxels are those of the first."""
    result, voxel_m = Volume(first.settings, threads), first.settings.voxel_m
    both = first.blocks.places[: first.blocks.count]
    places = np.unique(np.concatenate([both, _touched(second, first_second, voxel_m)]), axis=0)
    # The field counts in truncations; the second's may be another length.
    scale = second.settings.truncation_m / first.settings.truncation_m
    second_first, sure = first_second.inverse(), (second.settings.sure_m / first.settings.sure_m) ** 2
    for start in range(0, len(places), _AT_ONCE):
        part = places[start : start + _AT_ONCE]
        points = ((SIDE * part[:, np.newaxis] + INSIDE) * voxel_m).reshape(-1, 3).astype(np.float64)
        other = sampled(second.blocks, second.settings.voxel_m, second_first.apply(points), 1)
        numbers = first.blocks.find(part)
        has = (numbers >= 0)[:, np.newaxis]
        own_weight = np.where(has, first.blocks.weights[np.maximum(numbers, 0)], 0).ravel().astype(np.float64)
        own = first.blocks.field[np.maximum(numbers, 0)].ravel() / ONE
        tint = first.blocks.colours[np.maximum(numbers, 0)].reshape(-1, 3)
        # Not known around, and not one more voxel of a rim, is 0.
        weight = np.where(np.isfinite(other.values), other.weights / sure, 0.0)
        total = np.maximum(own_weight + weight, 1e-9)
        value = (own_weight * own + weight * np.clip(np.nan_to_num(other.values) * scale, -1, 1)) / total
        colour = (own_weight[:, np.newaxis] * tint + weight[:, np.newaxis] * other.colours) / total[:, np.newaxis]
        shape = (len(part), SIDE**3)
        result.put(
            BlockValues(
                part.astype(np.int32),
                np.rint(np.where(own_weight + weight > 0, value, 1.0) * ONE).astype(np.int16).reshape(shape),
                np.rint(np.minimum(own_weight + weight, MOST_WEIGHT)).astype(np.uint16).reshape(shape),
                np.rint(np.clip(colour, 0, 255)).astype(np.uint8).reshape(*shape, 3),
            )
        )
    return result


def _touched(second: Volume, first_second: SE3, voxel_m: float) -> NDArray[np.int32]:
    """Return the blocks (N, 3) of the first's grid that blocks of the second reach into."""
    side_m = SIDE * second.settings.voxel_m
    steps = np.stack(np.meshgrid(*(np.linspace(0, 1, 3),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = (second.blocks.places[: second.blocks.count, np.newaxis] + steps) * side_m
    there = first_second.apply(corners.reshape(-1, 3))
    return np.unique(np.floor(there / (SIDE * voxel_m)).astype(np.int32), axis=0)
