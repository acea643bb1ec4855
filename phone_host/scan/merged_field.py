"""Two fields of one thing put together, once it is known how they lie: the second is sampled at the voxels of the first. Pure."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import ONE, SIDE
from phone_host.scan.field_sample import sampled
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import MOST_WEIGHT

_AT_ONCE: Final = 64


def merged(first: Volume, second: Volume, first_second: SE3, threads: int = 1) -> Volume:
    """Put two volumes together.

    Args:
        first: in whose axes and voxels the result is.
        second: of the same thing.
        first_second: takes the second's points to the first.
        threads: of the result.

    Returns:
        A volume with what either has seen; where both have, the mean by their weights.
    """
    result, voxel_m = Volume(first.settings, threads), first.settings.voxel_m
    both = first.blocks.places[: first.blocks.count]
    places = np.unique(np.concatenate([both, _touched(second, first_second, voxel_m)]), axis=0)
    inside = _inside()
    # The field counts in truncations; the second's may be another length.
    scale = second.settings.truncation_m / first.settings.truncation_m
    second_first, sure = first_second.inverse(), (second.settings.sure_m / first.settings.sure_m) ** 2
    for start in range(0, len(places), _AT_ONCE):
        part = places[start : start + _AT_ONCE]
        points = ((SIDE * part[:, np.newaxis] + inside) * voxel_m).reshape(-1, 3).astype(np.float64)
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


def _inside() -> NDArray[np.int64]:
    """Return the voxels (512, 3) of a block, x, y, z, in the order of its values."""
    z, y, x = np.meshgrid(*(np.arange(SIDE),) * 3, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def _touched(second: Volume, first_second: SE3, voxel_m: float) -> NDArray[np.int32]:
    """Return the blocks (N, 3) of the first's grid that blocks of the second reach into."""
    side_m = SIDE * second.settings.voxel_m
    steps = np.stack(np.meshgrid(*(np.linspace(0, 1, 3),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = (second.blocks.places[: second.blocks.count, np.newaxis] + steps) * side_m
    there = first_second.apply(corners.reshape(-1, 3))
    return np.unique(np.floor(there / (SIDE * voxel_m)).astype(np.int32), axis=0)
