"""Small depth images of the views in a model, and where they were taken: for a box that is chosen when they have passed. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.carving import Carving
from phone_host.scan.view import View, halved

_WIDTH_PX: Final = 160
"""A pixel is some 3 mm of a thing on a table: a cell or two."""

_MOST: Final = 512
"""20 MB. When there are as many, every second one goes, and from then on every second view is kept."""


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    depth_m: NDArray[np.float16]
    geometry: StereoGeometry
    noise_px: float
    world_camera: SE3


class KeptDepths:
    """Depth images of the views so far, or of every second, fourth ... of them."""

    def __init__(self) -> None:
        self._kept: list[_Kept] = []
        self._seen, self._every = 0, 1

    def remember(self, view: View, world_camera: SE3) -> None:
        """Keep a view's depths, or pass over them.

        Args:
            view: what the camera saw.
            world_camera: where it was.
        """
        self._seen += 1
        if (self._seen - 1) % self._every:
            return
        depth, geometry, noise_px = view.depth_m, view.geometry, view.noise_px
        while depth.shape[1] > _WIDTH_PX:
            (depth, geometry), noise_px = halved(depth, geometry), noise_px / 2
        with np.errstate(over="ignore"):
            self._kept.append(_Kept(depth.astype(np.float16), geometry, noise_px, world_camera))
        if len(self._kept) >= _MOST:
            self._kept, self._every = self._kept[::2], 2 * self._every

    def carve(self, carving: Carving) -> None:
        """Let all of them carve.

        Args:
            carving: of any box.
        """
        for each in self._kept:
            depth = each.depth_m.astype(np.float32)
            black = np.zeros(depth.shape, np.uint8)
            view = View(
                grey=black,
                colours=black[..., np.newaxis],
                depth_m=depth,
                geometry=each.geometry,
                noise_px=each.noise_px,
            )
            carving.see(view, each.world_camera)
