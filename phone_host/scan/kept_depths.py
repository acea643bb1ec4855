"""Small depth images of the views in a model, and where they were taken: for a box that is chosen when they have passed. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.carving import Carving
from phone_host.scan.surface_error import FusedDepths, Texture, texture_of
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
    texture: Texture

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
        """Keep a view's depths, or pass over them.

        Args:
            number: of the view.
            view: what the camera saw.
            world_camera: where it was.
        """
        if self._is_next():
            self._keep(_small(number, view, world_camera))

    def keep_apart(self, number: int, view: View) -> None:
        """Keep the depths of a view whose place in the model is not known; of too many, the oldest go.

        Args:
            number: of the view.
            view: what the camera saw.
        """
        self._apart[number] = _small(number, view, SE3.identity())
        if len(self._apart) > _MOST:
            del self._apart[min(self._apart)]

    def joined(self, number: int, world_camera: SE3) -> View | None:
        """Take a view that was kept apart among those in the model.

        Args:
            number: of the view.
            world_camera: where it was.

        Returns:
            Its small depths, as a black view; None: they were not kept.
        """
        found = self._apart.pop(number, None)
        if found is None:
            return None
        if self._is_next():
            self._keep(replace(found, world_camera=world_camera))
        return found.view

    def move(self, world_cameras: Mapping[int, SE3]) -> None:
        """Put views where they were taken.

        Args:
            world_cameras: by the view's number; the others stay.
        """
        self._kept = [
            replace(each, world_camera=world_cameras.get(each.number, each.world_camera)) for each in self._kept
        ]

    @property
    def fused(self) -> list[FusedDepths]:
        """The depths of the views in the model, in the order in which they were taken."""
        ordered = sorted(self._kept, key=lambda each: each.number)
        return [FusedDepths(each.view, each.world_camera, each.texture) for each in ordered]

    def _is_next(self) -> bool:
        self._seen += 1
        return not (self._seen - 1) % self._every

    def _keep(self, kept: _Kept) -> None:
        self._kept.append(kept)
        if len(self._kept) >= _MOST:
            self._kept, self._every = self._kept[::2], 2 * self._every

    def carve(self, carving: Carving) -> None:
        """Let all of them carve.

        Args:
            carving: of any box.
        """
        for each in self._kept:
            carving.see(each.view, each.world_camera)


def _small(number: int, view: View, world_camera: SE3) -> _Kept:
    depth, geometry, step = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
    with np.errstate(over="ignore"):
        small = depth.astype(np.float16)
    return _Kept(number, small, geometry, view.noise_px / step, world_camera, texture_of(view.grey, depth.shape))
