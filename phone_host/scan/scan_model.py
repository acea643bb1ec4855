"""The surface that comes out of a scan: open where nobody looked, or closed where a box says what the thing is. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.unseen_surface import apply_unseen, filled_from_border, seen_triangles, unseen_share
from phone_host.model import UnseenSurface
from phone_host.scan.blocks import ONE, SIDE, Blocks, Box
from phone_host.scan.carving import Carving
from phone_host.scan.closing import Floor, closed
from phone_host.scan.ground import Ground
from phone_host.scan.mesh import Flags, Mesh, mesh_of, only, part_of, pieces_of, without_crumbs, without_loose_bodies
from phone_host.scan.surface_error import ErrorScope, FusedView, PoseErrors, surface_error
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import LEAST_WEIGHT, WEIGHT_ONE, VolumeSettings

_ON_A_VOXEL: Final = 0.005
"""A point lies on an edge between two voxels, at least a hundredth of it from either."""


@dataclass(frozen=True, slots=True, eq=False)
class ScanModel:
    """A surface.

    Attributes:
        mesh: its triangles.
        noise_m: (V,) float32 standard deviation of its points, m; NaN where nobody saw it.
        seen: (V,) whether some view saw the surface there; where none did, the colour comes from the border of what was seen.
        is_closed: whether what nobody saw was closed.
        error_scope: what the standard deviations cover.
    """

    mesh: Mesh
    noise_m: NDArray[np.float32]
    seen: NDArray[np.bool_]
    is_closed: bool = False
    error_scope: ErrorScope = ErrorScope.NOISE

    @property
    def unseen_share(self) -> float:
        """Share of the area that nobody saw, 0..1; NaN without a surface."""
        return unseen_share(self.mesh.points_m, self.mesh.triangles, self.seen)

    @property
    def seen_mesh(self) -> Mesh:
        """The triangles of which a view saw all corners: what can be compared with the truth."""
        return only(self.mesh, seen_triangles(self.mesh.triangles, self.seen))

    def with_unseen(self, choice: UnseenSurface) -> "ScanModel":
        """Return the model as files hold it.

        Args:
            choice: what becomes of the surface that nobody saw. Without it the model is open, and nothing tells any more how much it was.
        """
        if (
            choice is UnseenSurface.FILL or not self.is_closed
        ):  # `closed_model` fills it; an open surface has no such part
            return self
        mesh = self.mesh
        colours, remains = apply_unseen(mesh.colours, mesh.triangles, self.seen, choice)
        rest, used = part_of(replace(mesh, colours=colours), remains)
        is_closed = choice is not UnseenSurface.CUT
        return replace(self, mesh=rest, noise_m=self.noise_m[used], seen=self.seen[used], is_closed=is_closed)

    def judged(self, volume: Volume, views: Sequence[FusedView], pose_errors: PoseErrors) -> "ScanModel":
        """Return the model with the standard deviations that the views' agreement asks for: see `surface_error`."""
        noise_m, scope = surface_error(volume, views, self.mesh.points_m, self.noise_m, pose_errors)
        return replace(self, noise_m=noise_m, error_scope=scope)

    @staticmethod
    def empty() -> "ScanModel":
        """Return a model of nothing."""
        return ScanModel(Mesh.empty(), np.zeros(0, np.float32), np.zeros(0, np.bool_))


def open_model(volume: Volume) -> ScanModel:
    """Return the surface that was seen, without crumbs."""
    mesh = without_crumbs(mesh_of(volume.blocks, volume.settings.voxel_m, LEAST_WEIGHT))
    noise_m = surface_noise_m(mesh.points_m, volume.blocks, volume.settings)
    return ScanModel(mesh, noise_m, np.ones(len(mesh.points_m), np.bool_))


def closed_model(volume: Volume, carving: Carving, box: Box, floor: Floor | Ground | None) -> ScanModel:
    """Return the closed surface of what is in a box, without loose bodies."""
    voxel_m = volume.settings.voxel_m
    field = closed(volume.blocks, volume.settings, carving, box, floor)
    mesh = without_loose_bodies(mesh_of(field, voxel_m))
    weights = _weights(mesh.points_m, field, voxel_m)
    seen = weights >= LEAST_WEIGHT
    if isinstance(floor, Floor) and floor.is_printed:
        seen &= ~ink_points(mesh, weights, volume.blocks)
    seen &= ~specks(mesh, seen)
    colours = filled_from_border(mesh.colours, mesh.triangles, seen)
    noise_m = np.where(seen, surface_noise_m(mesh.points_m, volume.blocks, volume.settings), np.float32(np.nan))
    return ScanModel(Mesh(mesh.points_m, colours, mesh.triangles), noise_m.astype(np.float32), seen, is_closed=True)


def surface_noise_m(points_m: NDArray[np.float32], blocks: Blocks, settings: VolumeSettings) -> NDArray[np.float32]:
    """Return the standard deviation of points (N, 3) of the surface, (N,) m, if the views err independently; NaN where the volume holds nothing.

    A depth's weight is the inverse of its variance (`volume_settings`), so a sum of weights tells that of their mean.
    """
    numbers, at = blocks.locate(np.rint(points_m / settings.voxel_m).astype(np.int32))
    weights = np.where(numbers >= 0, blocks.weights[np.maximum(numbers, 0), at], 0).astype(np.float64)
    with np.errstate(divide="ignore"):
        noise = settings.sure_m * np.sqrt(WEIGHT_ONE / weights)
    return np.where(weights > 0, noise, np.nan).astype(np.float32)


def _weights(points_m: NDArray[np.float32], field: Blocks, voxel_m: float) -> NDArray[np.uint16]:
    """Return the lower weight of both ends of the edge that each point lies on, (V,)."""
    places, least = points_m.astype(np.float64) / voxel_m, np.full(len(points_m), np.iinfo(np.uint16).max, np.uint16)
    for aside in (-_ON_A_VOXEL, _ON_A_VOXEL):
        voxels = np.floor(places + aside) if aside > 0 else np.ceil(places + aside)
        numbers, at = field.locate(voxels.astype(np.int32))
        least = np.minimum(least, np.where(numbers >= 0, field.weights[np.maximum(numbers, 0), at], np.uint16(0)))
    return least


_REACH_M: Final = 0.010
"""Ink that was fused too high lies below this; measured below caps 9 and 20 mm above the sheet."""

_MARGIN: Final = 0.03
"""Share of the step from ink to paper by which a point may be brighter than ink. In shadow, ink is darker: of the wrong points 95 % are within it."""

_LEAST_VOXELS: Final = 500
_LEAST_CONTRAST: Final = 40.0
"""Grey levels between ink and paper. Sheet that shows less, or fewer voxels, does not tell how dark ink is."""

_SPECK_SHARE: Final = 0.002
"""Of the triangles of the largest piece that was measured. Smaller pieces amid unseen surface are wrong matches."""


def ink_points(mesh: Mesh, weights: NDArray[np.uint16], blocks: Blocks) -> Flags:
    """Return which points cannot be told from the mat's ink, (V,): low, as dark as ink, and measured less often than half of the surface.

    Ink has no texture. Where an object hangs over it, the matcher takes its depth from the object's edge: the sheet is fused up to 8 mm too high,
    as a dark curtain below the edge. Few views see in there, so no other view contradicts.

    Args:
        mesh: the surface in the mat's axes, with the colours of the volume.
        weights: (V,) of the voxels at its points.
        blocks: of the volume, with those of the sheet.
    """
    level = _ink_level(blocks)
    if not len(weights) or np.isnan(level):
        return np.zeros(len(weights), np.bool_)
    usual = np.median(weights[weights >= LEAST_WEIGHT]) if (weights >= LEAST_WEIGHT).any() else 0.0
    is_low = mesh.points_m[:, 2] < _REACH_M
    return np.asarray(is_low & (weights < usual) & (mesh.colours.mean(axis=1) < level), np.bool_)


def specks(mesh: Mesh, seen: Flags) -> Flags:
    """Return which points belong to no piece of measured surface of some size, (V,), by whether a view measured them, (V,)."""
    whole = mesh.triangles[np.logical_and.reduce(seen[mesh.triangles], axis=1)]
    if not len(whole):
        return np.zeros(len(seen), np.bool_)
    piece = pieces_of(Mesh(mesh.points_m, mesh.colours, whole))
    sizes = np.bincount(piece[whole[:, 0]], minlength=len(seen))
    return np.asarray(sizes[piece] < _SPECK_SHARE * sizes.max(), np.bool_)


def _ink_level(blocks: Blocks) -> float:
    """Return the grey level below which a point is as dark as ink; NaN: too little of the sheet was seen."""
    number = np.flatnonzero(blocks.places[: blocks.count, 2] == 0)
    lowest = np.s_[: SIDE * SIDE]  # the voxels of a block at z = 0 come first
    on_sheet = (blocks.weights[number, lowest] >= LEAST_WEIGHT) & (np.abs(blocks.field[number, lowest]) < ONE // 2)
    greys = blocks.colours[number, lowest][on_sheet].mean(axis=-1)
    if len(greys) < _LEAST_VOXELS:
        return float("nan")
    ink, paper = np.percentile(greys, (10, 90)).tolist()
    return float(ink + _MARGIN * (paper - ink)) if paper - ink >= _LEAST_CONTRAST else float("nan")
