"""Small copies of the views of a model, from which its field can be built again when parts of it have moved. Pure.

Their memory is bounded: when they are too many, every second one goes, and from then on every second view is kept. When so few were kept that
a surface may be seen by none of them, none is kept any more.
"""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import StereoGeometry
from phone_host.scan.view import View, narrowed

_WIDTH_PX: Final = 320
"""A voxel is some 2.5 px of the matched image for each metre of the distance (`fineness`): half of VGA leaves one depth for each voxel 0.8 m away."""

_QUALITY: Final = 90
"""Of the colours' JPEG: a tenth of their bytes, and its errors are less than a sensor's noise."""

_LEVEL: Final = 1
"""Of the depths' deflation: a room's become a quarter in 1 ms."""

_MOST_EVERY: Final = 8
"""Of so many views one is kept at least: neighbours share more than half of what they show after 8 views of a walk, seldom after 16."""


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    depth: bytes  # float16, m, deflated
    shape: tuple[int, ...]
    colours: NDArray[np.uint8]  # as JPEG
    geometry: StereoGeometry
    noise_px: float
    patch_px: float

    @property
    def bytes(self) -> int:
        return len(self.depth) + self.colours.nbytes

    @property
    def view(self) -> View:
        depth = np.frombuffer(zlib.decompress(self.depth), np.float16).reshape(self.shape).astype(np.float32)
        colours = cv2.imdecode(self.colours, cv2.IMREAD_COLOR)
        return View(
            grey=np.zeros(depth.shape, np.uint8),
            colours=np.asarray(colours, np.uint8),
            depth_m=depth,
            geometry=self.geometry,
            noise_px=self.noise_px,
            patch_px=self.patch_px,
        )


class KeptViews:
    """Copies of all views so far, or of every second, fourth or eighth.

    Args:
        most_bytes: of all of them together.
    """

    def __init__(self, most_bytes: int) -> None:
        self._kept: dict[int, _Kept] = {}
        self._most_bytes, self._bytes = most_bytes, 0
        self._seen, self._every = 0, 1

    @property
    def are_enough(self) -> bool:
        """Whether the field can be built from them."""
        return self._every <= _MOST_EVERY

    @property
    def every(self) -> int:
        """Of how many views one is kept now."""
        return self._every

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._kept)

    @property
    def bytes(self) -> int:
        """What they take."""
        return self._bytes

    def remember(self, number: int, view: View) -> None:
        """Keep a view, or pass over it.

        Args:
            number: of the view; it grows.
            view: with depth.
        """
        self._seen += 1
        if not self.are_enough or (self._seen - 1) % self._every:
            return
        self._kept[number] = _small(view)
        self._bytes += self._kept[number].bytes
        self.bound(self._most_bytes)

    def bound(self, most_bytes: int) -> None:
        """Let every second one go until the others take no more than so many bytes."""
        while self._bytes > most_bytes and self._kept:
            self._every *= 2
            numbers = list(self._kept)[::2] if self.are_enough else []
            self._kept = {number: self._kept[number] for number in numbers}
            self._bytes = sum(kept.bytes for kept in self._kept.values())

    def of(self, numbers: Sequence[int], step: int = 1) -> Iterator[tuple[int, View]]:
        """Give those of some views that are kept, each with its number, as black views with depth and colours.

        Args:
            numbers: of the views.
            step: 2: every second of those that are kept, 3: every third ...
        """
        for number in [number for number in numbers if number in self._kept][::step]:
            yield number, self._kept[number].view


def _small(view: View) -> _Kept:
    depth, geometry, step = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
    _, colours = cv2.imencode(
        ".jpg", np.ascontiguousarray(view.colours[::step, ::step]), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    with np.errstate(over="ignore"):
        deflated = zlib.compress(depth.astype(np.float16).tobytes(), _LEVEL)
    return _Kept(
        deflated, depth.shape, np.asarray(colours, np.uint8), geometry, view.noise_px / step, view.patch_px / step
    )
