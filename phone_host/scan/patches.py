"""The surface in patches, for whoever watches it grow: only those that changed are made again, and only those travel.

A patch is the surface in a cube of 8 x 8 x 8 blocks. Neighbours meet without a gap, but share no points.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import CORNERS, SIDE
from phone_host.scan.mesh import Mesh, mesh_of, part_of, thinned
from phone_host.scan.volume import Volume

SIDE_BLOCKS: Final = 8
"""Smaller patches cost more calls, larger ones are made again for less."""

_MOST_POINTS: Final = 65_535
"""What 16 bit count; a patch with more, which no real surface has, is thinned."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A patch.

    Attributes:
        number: grows with each patch that is made, so that who has seen some knows which are newer.
        place: of the cube, in cubes along x, y, z.
        side_m: of the cube; points lie at most a voxel beyond it.
        mesh: the surface in it; without triangles where there is none any more.
        seen: (V,) whether some view measured its points; of a surface that grows all are.
    """

    number: int
    place: tuple[int, int, int]
    side_m: float
    mesh: Mesh
    seen: NDArray[np.bool_]


class Patches:
    """All patches of a volume, as they were when they were last renewed.

    Args:
        least_weight: of a voxel that counts as seen.
        most_points: of a patch; one with more is thinned.
    """

    def __init__(self, least_weight: int, most_points: int = _MOST_POINTS) -> None:
        self._least_weight, self._most_points = least_weight, most_points
        self._made: dict[tuple[int, int, int], Patch] = {}
        self._seen = self._number = 0
        self._voxel_m = math.nan

    def renew(self, volume: Volume) -> None:
        """Make those again whose blocks have changed.

        Args:
            volume: always the same; it must not change meanwhile.
        """
        blocks, changed = volume.blocks, volume.changed_since(self._seen)
        self._seen = volume.fused
        # The cubes of marching reach into the next block along each axis: what lies before a changed block changes with it.
        touched = (blocks.places[changed][:, np.newaxis] - CORNERS.astype(np.int32)).reshape(-1, 3)
        wanted = np.unique(touched // SIDE_BLOCKS, axis=0)
        if not len(wanted):
            return
        voxel_m = volume.settings.voxel_m
        if voxel_m != self._voxel_m:  # the field has become coarser: its cubes are others
            for place in set(self._made) - set(map(tuple, wanted.tolist())):
                self._put(place, SIDE * SIDE_BLOCKS * voxel_m, Mesh.empty(), voxel_m)
        self._voxel_m = voxel_m
        cubes = blocks.places[: blocks.count] // SIDE_BLOCKS
        for place in wanted:
            self._make(volume, place, np.flatnonzero((cubes == place).all(axis=1)))

    def become(self, mesh: Mesh, voxel_m: float, seen: NDArray[np.bool_] | None = None) -> None:
        """Show another surface in place of the volume's: the finished one. The volume is not renewed afterwards.

        Args:
            mesh: the surface.
            voxel_m: of the field that it was made of, m.
            seen: (V,) whether some view measured its points; None: all are seen.
        """
        side_m = SIDE * SIDE_BLOCKS * voxel_m
        cubes = np.floor(mesh.points_m[mesh.triangles].mean(axis=1) / side_m).astype(np.int32)
        places, cube_of = np.unique(cubes, axis=0, return_inverse=True)
        parts = {tuple(place): part_of(mesh, cube_of == number) for number, place in enumerate(places.tolist())}
        for place in set(self._made) - set(parts):
            self._put(place, side_m, Mesh.empty(), voxel_m)
        for place, (part, used) in parts.items():
            self._put(place, side_m, part, voxel_m, None if seen is None else seen[used])

    def since(self, number: int, most_points: int) -> tuple[Patch, ...]:
        """Return the patches that are newer than one, oldest first.

        Args:
            number: of the newest that is known; 0: none is.
            most_points: of all of them together; one comes in any case.
        """
        newer = sorted((each for each in self._made.values() if each.number > number), key=lambda each: each.number)
        ends = np.cumsum([len(each.mesh.points_m) for each in newer])
        return tuple(newer[: max(1, int(np.searchsorted(ends, most_points, side="right")))])

    def _make(self, volume: Volume, place: NDArray[np.int32], numbers: NDArray[np.int64]) -> None:
        voxel_m = volume.settings.voxel_m
        x, y, z = place.tolist()
        side_m = SIDE * SIDE_BLOCKS * voxel_m
        self._put((x, y, z), side_m, mesh_of(volume.blocks, voxel_m, self._least_weight, numbers), voxel_m)

    def _put(
        self,
        place: tuple[int, int, int],
        side_m: float,
        mesh: Mesh,
        voxel_m: float,
        seen: NDArray[np.bool_] | None = None,
    ) -> None:
        most, seen = len(mesh.triangles), np.ones(len(mesh.points_m), np.bool_) if seen is None else seen
        while len(mesh.points_m) > self._most_points:
            most //= 2
            mesh, stand_for = thinned(mesh, most, voxel_m)
            seen = seen[stand_for]
        if len(mesh.triangles) or place in self._made:
            self._number += 1
            self._made[place] = Patch(self._number, place, side_m, mesh, seen)
