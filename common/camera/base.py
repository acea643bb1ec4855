"""A camera is a source of still-encoded frames with stamps. Board and host use the same ones.

A camera never blocks: it says what to wait for (`pollable`, `due_ns`) and then gives what has come since.
"""

from dataclasses import dataclass
from typing import Protocol

from common.frame import Frame, FrameFault
from common.protocol.message import CameraDescription


@dataclass(frozen=True, slots=True)
class Spoiled:
    """A grab whose bytes are no whole image; it has a sequence number like any other.

    Attributes:
        sequence: number of the grab.
        fault: what is wrong with the bytes.
    """

    sequence: int
    fault: FrameFault


@dataclass(frozen=True, slots=True)
class Ended:
    """No frame will follow."""


Grab = Frame | Spoiled | Ended


class Camera(Protocol):
    """What every camera offers."""

    @property
    def description(self) -> CameraDescription:
        """Size, encoding, period and pacing."""

    @property
    def pollable(self) -> int | None:
        """A file descriptor that becomes readable with a frame; None for a camera that goes by `due_ns` alone."""

    def due_ns(self, now_ns: int) -> int:
        """When `read` will have something, ns on the machine's CLOCK_MONOTONIC; the far future if that is up to `pollable` or demand."""

    def read(self, now_ns: int) -> list[Grab]:
        """Give what has come since the last call, oldest first, without waiting.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns. A demand-paced camera gives one image for each call.
        """

    def anchor(self, first_ns: int) -> None:
        """Set the stamp of a demand-paced camera's first image, ns; later calls and other cameras take no notice."""

    def close(self) -> None:
        """Let go of the device."""
