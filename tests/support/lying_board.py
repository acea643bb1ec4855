"""A board whose camera shows a film with every other image replaced by something else, and whose headers may say anything."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from common import now
from common.camera.base import Grab
from common.camera.replay import ReplayCamera, ReplaySettings
from common.frame import Frame, PixelFormat


@dataclass(frozen=True, slots=True)
class Lie:
    """A frame that replaces an honest one.

    Attributes:
        payload: its bytes.
        size_px: width and height in its header; None: the camera's.
        pixel_format: in its header.
    """

    payload: bytes
    size_px: tuple[int, int] | None = None
    pixel_format: PixelFormat = PixelFormat.MJPEG


class LyingCamera(ReplayCamera):
    """A film, alternating with lies.

    Args:
        folder: the film.
        fps: of both together.
        lies: in turn, over and over; none: all frames are honest.
        size_px: the size that the camera claims; None: the film's size.
    """

    def __init__(self, folder: Path, fps: int, lies: Sequence[Lie], size_px: tuple[int, int] | None = None) -> None:
        super().__init__(
            ReplaySettings(path=str(folder), fps=Fraction(fps), loop=True, clock="board"), now.monotonic_ns()
        )
        if size_px is not None:
            self.description = replace(self.description, width_px=size_px[0], height_px=size_px[1])
        self._lies = itertools.cycle(lies) if lies else None

    def read(self, now_ns: int) -> list[Grab]:
        """Honest images have even numbers."""
        return [self._turned(grab) for grab in super().read(now_ns)]

    def _turned(self, grab: Grab) -> Grab:
        if self._lies is None or not isinstance(grab, Frame) or grab.sequence % 2 == 0:
            return grab
        lie = next(self._lies)
        width_px, height_px = lie.size_px or (grab.width_px, grab.height_px)
        return replace(grab, payload=lie.payload, width_px=width_px, height_px=height_px, pixel_format=lie.pixel_format)
