"""Volumes computed from a shape, as if views had seen all of it that does not face downwards."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import ONE, SIDE, VOXELS
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import VolumeSettings

Floats = NDArray[np.float64]

SEEN: Final = 200
_STEP_M: Final = 1e-5


def volume_of(
    off_m: Callable[[Floats], Floats],
    tint: Callable[[Floats], Floats],
    *,
    up: Floats,
    moved: SE3,
    reach_m: float,
    voxel_m: float = 0.002,
) -> Volume:
    """Compute a volume.

    Args:
        off_m: distances of points (N, 3), m, from the shape's surface, (N,), negative inside.
        tint: brightness 0 to 255 (N,) of points.
        up: (3,) what faces away from it was not seen.
        moved: takes the shape's points to the volume's world.
        reach_m: the shape lies within so much of the origin, m.
        voxel_m: of the volume.
    """
    volume = Volume(VolumeSettings(voxel_m=voxel_m, far_m=1.0))
    side = SIDE * voxel_m
    middle = moved.apply(np.zeros((1, 3)))[0]
    low, high = (np.floor((middle + sign * reach_m) / side).astype(np.int64) for sign in (-1, 1))
    grid = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij")
    places = np.stack(grid, axis=-1).reshape(-1, 3)
    z, y, x = np.meshgrid(*(np.arange(SIDE),) * 3, indexing="ij")
    inside = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    world = ((SIDE * places[:, np.newaxis] + inside) * voxel_m).reshape(-1, 3).astype(np.float64)
    own = moved.inverse().apply(world)
    off = off_m(own)
    rise = sum((off_m(own + _STEP_M * axis) - off)[:, np.newaxis] * axis / _STEP_M for axis in np.eye(3))
    seen = (np.abs(off) < volume.settings.truncation_m) & (np.asarray(rise) @ up > -0.5)
    field = np.clip(off / volume.settings.truncation_m, -1, 1) * ONE
    shape = (len(places), VOXELS)
    grey = np.repeat(tint(own)[:, np.newaxis], 3, axis=1)
    wanted = seen.reshape(shape).any(axis=1)
    volume.put(
        BlockValues(
            places[wanted].astype(np.int32),
            np.rint(field).astype(np.int16).reshape(shape)[wanted],
            np.where(seen, SEEN, 0).astype(np.uint16).reshape(shape)[wanted],
            np.rint(grey).astype(np.uint8).reshape(*shape, 3)[wanted],
        )
    )
    return volume
