"""The ring of buffers that a V4L2 driver fills and this process maps: start, take, give back, stop."""

import ctypes
import errno
import mmap
from typing import Final

from common.camera import v4l2_abi as abi
from common.camera.v4l2_device import Device, ioctl, taken
from common.value import value

RING_BUFFERS: Final = 4
"""Fewest that never starve a driver: one being filled, one next, one being read here, one spare for a late reader. DESIGN asks for 4."""


@value(kw_only=True)
class Filled:
    """A buffer filled by the driver; it must be given back.

    Attributes:
        index: which buffer.
        used_bytes: length of its content.
        flags: V4L2_BUF_FLAG bits.
        stamp_ns: the kernel's stamp, ns, on the clock named by the flags.
        sequence: number of the frame since the stream began, 32 bits.
    """

    index: int
    used_bytes: int
    flags: int
    stamp_ns: int
    sequence: int


class Ring:
    """Mapped buffers of an open device whose format is set.

    Args:
        device: the device; must outlive the ring.

    Raises:
        TakenError: another program has the camera.
        OSError: the driver refuses.
    """

    def __init__(self, device: Device) -> None:
        self._fd = device.fd
        request = abi.BufferRequest(count=RING_BUFFERS, type=abi.BUF_TYPE_VIDEO_CAPTURE, memory=abi.MEMORY_MMAP)
        try:
            ioctl(self._fd, abi.REQBUFS, request)
        except OSError as error:
            if error.errno == errno.EBUSY:
                raise taken(device.path) from None
            raise
        self._maps: list[mmap.mmap] = []
        self._views: list[memoryview] = []
        self._shape = self._find_shape()
        self._buffer = self._new_buffer()
        try:
            for index in range(request.count):
                self._map(index)
        except OSError:
            self.close()
            raise

    def __len__(self) -> int:
        return len(self._maps)

    def start(self) -> None:
        """Give all buffers to the driver and start the stream."""
        for index in range(len(self._maps)):
            self.give_back(index)
        ioctl(self._fd, abi.STREAMON, ctypes.c_int(abi.BUF_TYPE_VIDEO_CAPTURE))

    def stop(self) -> None:
        """Stop the stream and take all buffers back; they stay mapped."""
        ioctl(self._fd, abi.STREAMOFF, ctypes.c_int(abi.BUF_TYPE_VIDEO_CAPTURE))

    def take(self) -> Filled | None:
        """Take the oldest filled buffer; None if none is ready.

        Raises:
            OSError: the camera is gone or the driver failed.
        """
        buffer = self._buffer
        try:
            ioctl(self._fd, self._shape.dqbuf, buffer)
        except BlockingIOError:
            return None
        stamp_ns = buffer.seconds * 1_000_000_000 + buffer.microseconds * 1000
        return Filled(
            index=buffer.index,
            used_bytes=buffer.bytesused,
            flags=buffer.flags,
            stamp_ns=stamp_ns,
            sequence=buffer.sequence,
        )

    def give_back(self, index: int) -> None:
        """Let the driver fill a buffer again."""
        buffer = self._buffer
        buffer.index = index
        ioctl(self._fd, self._shape.qbuf, buffer)

    def view(self, filled: Filled) -> memoryview:
        """The content of a filled buffer, in place. Release the view before giving the buffer back."""
        return self._views[filled.index][: filled.used_bytes]

    def close(self) -> None:
        """Unmap; the driver frees the buffers when the device is closed."""
        for view in self._views:
            view.release()
        for item in self._maps:
            item.close()
        self._views.clear()
        self._maps.clear()

    def _new_buffer(self) -> ctypes.Structure:
        return self._shape.buffer(type=abi.BUF_TYPE_VIDEO_CAPTURE, memory=abi.MEMORY_MMAP)

    def _find_shape(self) -> abi.Layout:
        """The layout of struct v4l2_buffer that this kernel accepts."""
        for shape in abi.LAYOUTS:
            try:
                ioctl(self._fd, shape.querybuf, shape.buffer(type=abi.BUF_TYPE_VIDEO_CAPTURE, memory=abi.MEMORY_MMAP))
            except OSError as error:
                if error.errno == errno.ENOTTY and shape is not abi.LAYOUTS[-1]:
                    continue
                raise
            return shape
        raise AssertionError("LAYOUTS is never empty")

    def _map(self, index: int) -> None:
        buffer = self._new_buffer()
        buffer.index = index
        ioctl(self._fd, self._shape.querybuf, buffer)
        mapped = mmap.mmap(self._fd, buffer.length, mmap.MAP_SHARED, mmap.PROT_READ, offset=buffer.offset)
        self._maps.append(mapped)
        self._views.append(memoryview(mapped))
