"""The surface that comes out of a scan: open where nobody looked, or closed where a box says what the thing is. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import SIDE, Blocks
from phone_host.scan.box import Box
from phone_host.scan.carving import Carving
from phone_host.scan.closing import Floor, closed
from phone_host.scan.ground import Ground
from phone_host.scan.mesh import Mesh, mesh_of
from phone_host.scan.mesh_parts import areas_m2, only, without_crumbs, without_loose_bodies
from phone_host.scan.surface_noise import surface_noise_m
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import LEAST_WEIGHT

UNSEEN_RGB: Final = (214, 74, 214)
"""Colour of a surface that nobody saw: few things are pink all over."""

_ON_A_VOXEL: Final = 0.005
"""A point lies on an edge between two voxels, at least a hundredth of it from either."""


@dataclass(frozen=True, slots=True, eq=False)
class ScanModel:
    """A surface.

    Attributes:
        mesh: its triangles.
        noise_m: (V,) float32 standard deviation of its points, m, if the views err independently; NaN where nobody saw it.
        seen: (V,) whether some view saw the surface there; where none did, a closed surface has a colour of its own.
        is_closed: whether what nobody saw was closed.
    """

    mesh: Mesh
    noise_m: NDArray[np.float32]
    seen: NDArray[np.bool_]
    is_closed: bool = False

    @property
    def unseen_share(self) -> float:
        """Share of the area that nobody saw, 0..1; NaN without a surface."""
        areas, corners = areas_m2(self.mesh), self.seen[self.mesh.triangles]
        return float(((~corners).mean(axis=1) * areas).sum() / areas.sum()) if areas.sum() > 0 else float("nan")

    @property
    def seen_mesh(self) -> Mesh:
        """The triangles of which a view saw all corners: what can be compared with the truth."""
        return only(self.mesh, np.logical_and.reduce(self.seen[self.mesh.triangles], axis=1))

    @staticmethod
    def empty() -> "ScanModel":
        """Return a model of nothing."""
        return ScanModel(Mesh.empty(), np.zeros(0, np.float32), np.zeros(0, np.bool_))


def open_model(volume: Volume) -> ScanModel:
    """Return the surface that was seen, without crumbs.

    Args:
        volume: of the scan.
    """
    mesh = without_crumbs(mesh_of(volume.blocks, volume.settings.voxel_m, LEAST_WEIGHT))
    noise_m = surface_noise_m(mesh.points_m, volume.blocks, volume.settings)
    return ScanModel(mesh, noise_m, np.ones(len(mesh.points_m), np.bool_))


def closed_model(volume: Volume, carving: Carving, box: Box, floor: Floor | Ground | None) -> ScanModel:
    """Return the closed surface of what is in a box, without loose bodies.

    Args:
        volume: of the scan.
        carving: what the views told of the box.
        box: where the thing is.
        floor: what it stands on; None: nothing.
    """
    voxel_m = volume.settings.voxel_m
    field = closed(volume.blocks, volume.settings, carving, box, floor)
    mesh = without_loose_bodies(mesh_of(field, voxel_m))
    seen = _seen(mesh.points_m, field, voxel_m)
    colours = np.where(seen[:, np.newaxis], mesh.colours, np.array(UNSEEN_RGB, np.uint8))
    noise_m = np.where(seen, surface_noise_m(mesh.points_m, volume.blocks, volume.settings), np.float32(np.nan))
    return ScanModel(Mesh(mesh.points_m, colours, mesh.triangles), noise_m.astype(np.float32), seen, is_closed=True)


def _seen(points_m: NDArray[np.float32], field: Blocks, voxel_m: float) -> NDArray[np.bool_]:
    """Return whether a surface was seen at both ends of the edge that each point lies on, (V,)."""
    places, seen = points_m.astype(np.float64) / voxel_m, np.ones(len(points_m), np.bool_)
    for aside in (-_ON_A_VOXEL, _ON_A_VOXEL):
        voxels = (np.floor(places + aside) if aside > 0 else np.ceil(places + aside)).astype(np.int32)
        numbers = field.find(voxels >> 3)
        at = (voxels & (SIDE - 1)) @ np.array([1, SIDE, SIDE**2])
        seen &= (numbers >= 0) & (field.weights[np.maximum(numbers, 0), at] >= LEAST_WEIGHT)
    return seen
