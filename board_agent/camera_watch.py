"""Waits on a camera's descriptor, which changes when a device is lost and comes back."""

import select

from common.camera.base import Camera
from common.link.waiter import Waiter


class CameraWatch:
    """Keeps a waiter's descriptor of a camera up to date.

    Attributes:
        fd: the descriptor that the waiter waits on; None: there is none.
    """

    def __init__(self, camera: Camera, waiter: Waiter) -> None:
        self._camera, self._waiter = camera, waiter
        self.fd: int | None = None

    def look(self) -> int | None:
        """Wait on what is the camera's descriptor now, and return it. Called before each wait."""
        if (fd := self._camera.pollable) == self.fd:
            return fd
        if self.fd is not None:
            self._waiter.remove(self.fd)
        self.fd = fd
        if fd is not None:
            self._waiter.add(fd, select.POLLIN | select.POLLPRI)
        return fd
