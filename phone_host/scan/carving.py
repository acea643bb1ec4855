"""Where in a box the cameras looked through, and where something hid what lies there. Pure.

The volume knows the space near surfaces only. A closed model also needs to know what is empty, so a grid of cells counts the views that
measured something clearly beyond each cell - the mat, the table, the background - and those that measured something clearly before it.

Source: K. N. Kutulakos and S. M. Seitz, "A Theory of Shape by Space Carving", 2000.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.native.volume_jobs import CarveJob
from phone_host.scan.blocks import Cells
from phone_host.scan.view import View
from phone_host.scan.volume import aim, rows_of

_SIGMAS: Final = 3.0
_HALF_DIAGONAL: Final = 0.87
_LEAST_VIEWS: Final = 2
"""A single wrong depth must not dig into a thing."""

_LEAST_SHARE: Final = 0.125
"""Of the views that tell something of a cell; what is looked through by fewer is hidden, and some depths were wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class Carved:
    """What a carving has counted.

    Attributes:
        cells: how the grid lies.
        counts: (3, Z, Y, X) uint8, as in `Carving`.
        views: that were seen.
    """

    cells: Cells
    counts: NDArray[np.uint8]
    views: int


class Carving:
    """Counts, for each cell of a box, the views that looked through it.

    Attributes:
        cells: how the grid lies.
        counts: (3, Z, Y, X) uint8, 255 = that or more: views that looked through a cell, because they measured something clearly beyond it; those
            from which it is hidden, because they measured something clearly before it; those that have no depth there.
        views: that were seen.
    """

    def __init__(self, cells: Cells, threads: int = 1, library: Library | Diagnostic | None = None) -> None:
        found = native() if library is None else library
        self._library = found if isinstance(found, Library) else None
        self._threads, self.cells, self.views = threads, cells, 0
        self.counts = np.zeros((3, *cells.counts[::-1]), np.uint8)

    def see(self, view: View, world_camera: SE3) -> None:
        """Take a view; its depths count however far they are; infinite: nothing is there."""
        self.views += 1
        depth = np.ascontiguousarray(view.depth_m, np.float32)
        clear_m = _HALF_DIAGONAL * self.cells.side_m
        if self._library is None:
            pose = np.column_stack([world_camera.inverse().R, world_camera.inverse().t_m]).astype(np.float32)
            told = _told_by_numpy(self.cells, replace(view, depth_m=depth), pose, _SIGMAS, clear_m)
            self.counts += np.array(told) & (self.counts < 255)
            return
        job = CarveJob(
            looked_through=self.counts[0].ctypes.data,
            hidden=self.counts[1].ctypes.data,
            blank=self.counts[2].ctypes.data,
            depth_m=depth.ctypes.data,
            camera_world=rows_of(world_camera.inverse()),
            counts=self.cells.counts,
            low_m=tuple(self.cells.first_m.tolist()),
            cell_m=self.cells.side_m,
            noise_per_m=view.noise_per_m,
            sigmas=_SIGMAS,
            clear_m=clear_m,
            threads=self._threads,
        )
        aim(job, view.geometry, depth.shape)
        self._library.run(job)

    def take_empty(self, cells: NDArray[np.bool_]) -> None:
        """Take cells (Z, Y, X) for empty, whatever the views have seen of them."""
        self.counts[0][cells], self.counts[1][cells] = 255, 0

    def take_in(self, carved: Carved) -> None:
        """Add what another one has counted, in any cells of the same axes: each cell gets what that one tells of its middle."""
        own, of = self.cells, carved.cells
        chosen, there = [np.arange(3)], [np.arange(3)]
        for axis in (2, 1, 0):
            middles = (own.first_m[axis] + np.arange(own.counts[axis]) * own.side_m) / of.voxel_m
            numbers = np.floor(np.floor(middles + 0.5) / of.voxels).astype(np.int64) - of.low[axis]
            inside = np.flatnonzero((numbers >= 0) & (numbers < of.counts[axis]))
            chosen.append(inside)
            there.append(numbers[inside])
        told = self.counts[np.ix_(*chosen)].astype(np.int64) + carved.counts[np.ix_(*there)]
        self.counts[np.ix_(*chosen)] = np.minimum(told, 255)
        self.views += carved.views

    @property
    def empty(self) -> NDArray[np.bool_]:
        """(Z, Y, X): the cells that views enough looked through."""
        through, hidden, _ = self.counts.astype(np.float32)
        least = min(_LEAST_VIEWS, self.views)
        return np.asarray((through >= max(least, 1)) & (through >= _LEAST_SHARE * (through + hidden)), np.bool_)

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """(Z, Y, X): the others that something hid, from more views than have no depth there: a thing is seen from most sides, its shadow is not."""
        _, hidden, blank = self.counts
        return ~self.empty & (hidden > 0) & (hidden >= blank)

    @property
    def carved(self) -> Carved:
        """A copy of what was counted."""
        return Carved(self.cells, self.counts.copy(), self.views)

    def go_on(self, carved: Carved) -> None:
        """Go on from what another one has counted in the same cells."""
        self.counts[:], self.views = carved.counts, carved.views


F: Final = np.float32
Flags = NDArray[np.bool_]


def _told_by_numpy(
    cells: Cells, view: View, camera_world: NDArray[np.float32], sigmas: float, clear_m: float
) -> tuple[Flags, Flags, Flags]:
    """Return the cells that a view looked through, those that it found hidden, and those where it has no depth, (Z, Y, X) each.

    Args:
        cells: how the grid lies.
        view: what was seen.
        camera_world: (3, 4) float32 rows of the pose.
        sigmas: standard deviations of a depth that make it clear.
        clear_m: and how far beyond that, m.
    """
    wide, deep, tall = cells.counts
    through, behind, blank = (np.zeros((tall, deep, wide), np.bool_) for _ in range(3))
    along, across, up = (
        first + np.arange(count, dtype=F) * F(cells.side_m)
        for first, count in zip(cells.first_m, cells.counts, strict=True)
    )
    for layer in range(tall):
        through[layer], behind[layer], blank[layer] = _layer(
            view, camera_world, (along, across, up[layer]), (F(sigmas), F(clear_m))
        )
    return through, behind, blank


def _layer(
    view: View,
    pose: NDArray[np.float32],
    at: tuple[NDArray[np.float32], NDArray[np.float32], np.float32],
    limits: tuple[np.float32, np.float32],
) -> tuple[Flags, Flags, Flags]:
    along, across, up = at
    camera = []
    for row in pose:
        start = row[1] * across + row[2] * up + row[3]
        camera.append(start[:, np.newaxis] + row[0] * along)
    depth, focal = camera[2], F(view.geometry.focal_px)
    safe = np.maximum(depth, F(1e-3))
    u = focal * camera[0] / safe + F(view.geometry.cx_px) + F(0.5)
    v = focal * camera[1] / safe + F(view.geometry.cy_px) + F(0.5)
    height, width = view.depth_m.shape
    inside = (depth > F(1e-3)) & (u >= 0) & (v >= 0) & (u < F(width)) & (v < F(height))
    pixels = np.where(inside, v, 0).astype(np.int64) * width + np.where(inside, u, 0).astype(np.int64)
    seen = np.where(inside, view.depth_m.ravel()[pixels].astype(F), F(np.nan))
    sigmas, clear_m = limits
    with np.errstate(invalid="ignore", over="ignore"):
        clear = clear_m + sigmas * F(view.noise_per_m) * seen * seen
        return np.isposinf(seen) | (seen - depth > clear), depth - seen > clear, inside & ~(seen > 0)
