"""What views in the model tell beside its field: which cells of a box they looked through, and their small depths. Pure.

A box that is known when the scan begins is carved as the views come. One that is chosen later is carved by their depth images, which are kept small.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.blocks import Cells
from phone_host.scan.carving import Carved, Carving
from phone_host.scan.surface_error import FusedView
from phone_host.scan.view import View, narrowed

_WIDTH_PX: Final = 160
"""A pixel is some 3 mm of a thing on a table: a cell or two."""

_MOST: Final = 512
"""40 MB. When there are as many, every second one goes, and from then on every second view is kept."""


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    number: int
    depth_m: NDArray[np.float16]
    geometry: StereoGeometry
    noise_px: float
    world_camera: SE3

    @property
    def view(self) -> View:
        """Its depths as a view that can carve; black."""
        depth = self.depth_m.astype(np.float32)
        black = np.zeros(depth.shape, np.uint8)
        return View(
            grey=black, colours=black[..., np.newaxis], depth_m=depth, geometry=self.geometry, noise_px=self.noise_px
        )


class KeptDepths:
    """Depth images of the views so far, or of every second, fourth ... of them; and of the last that are in no model yet."""

    def __init__(self) -> None:
        self._kept: list[_Kept] = []
        self._apart: dict[int, _Kept] = {}
        self._seen, self._every = 0, 1

    def remember(self, number: int, view: View, world_camera: SE3) -> None:
        """Keep a view's depths, or pass over them."""
        if self._is_next():
            self._keep(_small(number, view, world_camera))

    def keep_apart(self, number: int, view: View) -> None:
        """Keep the depths of a view whose place in the model is not known; of too many, the oldest go."""
        self._apart[number] = _small(number, view, SE3.identity())
        if len(self._apart) > _MOST:
            del self._apart[min(self._apart)]

    def joined(self, number: int, world_camera: SE3) -> View | None:
        """Take a view that was kept apart among those in the model; return its small depths as a black view, None: they were not kept."""
        found = self._apart.pop(number, None)
        if found is None:
            return None
        if self._is_next():
            self._keep(replace(found, world_camera=world_camera))
        return found.view

    def move(self, world_cameras: Mapping[int, SE3]) -> None:
        """Put views where they were taken, by their numbers; the others stay."""
        self._kept = [
            replace(each, world_camera=world_cameras.get(each.number, each.world_camera)) for each in self._kept
        ]

    @property
    def fused(self) -> list[FusedView]:
        """The depths of the views in the model, in the order in which they were taken."""
        ordered = sorted(self._kept, key=lambda each: each.number)
        return [(each.view, each.world_camera) for each in ordered]

    def _is_next(self) -> bool:
        self._seen += 1
        return not (self._seen - 1) % self._every

    def _keep(self, kept: _Kept) -> None:
        self._kept.append(kept)
        if len(self._kept) >= _MOST:
            self._kept, self._every = self._kept[::2], 2 * self._every

    def carve(self, carving: Carving) -> None:
        """Let all of them carve a box."""
        for each in self._kept:
            carving.see(each.view, each.world_camera)


def _small(number: int, view: View, world_camera: SE3) -> _Kept:
    depth, geometry, step = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
    with np.errstate(over="ignore"):
        small = depth.astype(np.float16)
    return _Kept(number, small, geometry, view.noise_px / step, world_camera)


class Fusion:
    """Takes the views whose poses are known.

    Attributes:
        depths: that are kept of them.
        carving: of the box that was known as they came, or that the surface has carved; None: there is none.
    """

    def __init__(self, threads: int) -> None:
        self.depths, self._threads = KeptDepths(), threads
        self.carving: Carving | None = None

    @property
    def carved(self) -> Carved | None:
        """What the views have told of the box so far."""
        return None if self.carving is None else self.carving.carved

    def carve(self, cells: Cells | None) -> None:
        """Carve in cells from now on; what was told in others is taken over. None: there is no box."""
        before, self.carving = self.carved, None if cells is None else Carving(cells, self._threads)
        if before is not None and self.carving is not None:
            self.carving.take_in(before)

    def add(self, number: int, view: View, world_camera: SE3) -> None:
        """Take a view that is in the model."""
        self.depths.remember(number, view, world_camera)
        if self.carving is not None:
            self.carving.see(view, world_camera)

    def join(self, number: int, world_camera: SE3) -> None:
        """Take a view whose depths were kept apart, and that has become part of the model."""
        seen = self.depths.joined(number, world_camera)
        if seen is not None and self.carving is not None:
            self.carving.see(seen, world_camera)

    def move(self, world_cameras: Mapping[int, SE3]) -> None:
        """Let views that loops have moved carve again, from where they were taken."""
        self.depths.move(world_cameras)
        if self.carving is not None:
            self.carving = self._carved_by_depths(self.carving.cells)

    def carving_in(self, cells: Cells) -> Carving:
        """Return what the views tell of cells; of others than those that were carved as they came, by what was kept of their depths."""
        is_known = self.carving is not None and self.carving.cells == cells
        return self.carving if is_known and self.carving is not None else self._carved_by_depths(cells)

    def _carved_by_depths(self, cells: Cells) -> Carving:
        carving = Carving(cells, self._threads)
        self.depths.carve(carving)
        return carving
