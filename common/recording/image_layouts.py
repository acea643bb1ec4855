"""How the images of other programs' messages become images that a camera of ours could have given. Pure.

The bytes decide, not the label beside them: what begins as a JPEG is one. Raw rows may be padded. Raw colours become PNG without loss, because
no frame of ours holds them; so does grey of 16 bits.
Source: sensor_msgs/image_encodings.hpp (names of the encodings); PNG 1.2, sections 2.7, 4.1 and 6.1.
"""

import struct
import zlib
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, assert_never

from common.frame import Buffer, PixelFormat
from common.recording.cdr import BrokenMessageError

_COMPRESSED_STARTS: Final = {b"\xff\xd8\xff": PixelFormat.MJPEG, b"\x89PNG\r\n\x1a\n": PixelFormat.PNG}
_OTHER_STARTS: Final = {
    b"RIFF": "WebP",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"\0\0\0\1": "video (H.264 or H.265)",
}
_MAX_ALIGNMENT_BYTES: Final = 256
"""Largest multiple to which a driver pads its rows; a row twice as long as its pixels and longer than this is of another encoding."""

_MAX_LABEL: Final = 40


class UnreadableEncodingError(BrokenMessageError):
    """Raised for an image that is whole, in an encoding that is not read. Nobody's fault: another program made it."""


class Order(Enum):
    """How the bytes of a raw image's pixels are put into the order of ours."""

    AS_IT_IS = "as it is"
    SWAPPED = "each two exchanged"
    RGB = "red first"
    BGR = "blue first"
    RGBA = "red first, with opacity"
    BGRA = "blue first, with opacity"
    GREY16 = "grey of 16 bits"


@dataclass(frozen=True, slots=True)
class Encoding:
    """A raw encoding.

    Attributes:
        order: of the bytes.
        pixel_bytes: bytes of a pixel in its row.
        pixel_format: what its images become.
        rows: rows of bytes for two rows of pixels: 3 where chrominance follows the luminance.
    """

    order: Order
    pixel_bytes: int
    pixel_format: PixelFormat
    rows: int = 2


_GREY: Final = Encoding(Order.AS_IT_IS, 1, PixelFormat.GREY)
_GREY16: Final = Encoding(Order.GREY16, 2, PixelFormat.PNG)
_BGR: Final = Encoding(Order.BGR, 3, PixelFormat.PNG)
_BGRA: Final = Encoding(Order.BGRA, 4, PixelFormat.PNG)
_YUYV: Final = Encoding(Order.AS_IT_IS, 2, PixelFormat.YUYV)
_UYVY: Final = Encoding(Order.SWAPPED, 2, PixelFormat.YUYV)
ENCODINGS: Final = {
    "mono8": _GREY,
    "8uc1": _GREY,
    "mono16": _GREY16,
    "16uc1": _GREY16,
    "rgb8": Encoding(Order.RGB, 3, PixelFormat.PNG),
    "bgr8": _BGR,
    "8uc3": _BGR,
    "rgba8": Encoding(Order.RGBA, 4, PixelFormat.PNG),
    "bgra8": _BGRA,
    "8uc4": _BGRA,
    "yuv422_yuy2": _YUYV,
    "yuyv": _YUYV,
    "yuv422": _UYVY,
    "uyvy": _UYVY,
    "nv12": Encoding(Order.AS_IT_IS, 1, PixelFormat.NV12, rows=3),
}
"""Encodings of raw images that are read, by their names in small letters. OpenCV's names without meaning (`8UC3`) are in its order, blue first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RawLayout:
    """A raw image and how its bytes lie.

    Attributes:
        encoding: of its pixels.
        width: of a row, px.
        height: number of rows of pixels.
        step_bytes: from the begin of one row to that of the next.
        is_big_endian: of pixels of 16 bits: whether the high byte comes first.
    """

    encoding: Encoding
    width: int
    height: int
    step_bytes: int
    is_big_endian: bool = False

    @property
    def is_packed(self) -> bool:
        """Whether the bytes are already those of a frame."""
        return self.encoding.order is Order.AS_IT_IS and self.step_bytes == self.row_bytes

    @property
    def row_bytes(self) -> int:
        """Bytes of a row's pixels."""
        return self.width * self.encoding.pixel_bytes

    @property
    def rows(self) -> int:
        """Number of rows of bytes."""
        return self.height * self.encoding.rows // 2


def compressed_format(data: Buffer, label: str) -> PixelFormat:
    """Return the encoding of a compressed image by its first bytes.

    Raises:
        UnreadableEncodingError: it is neither JPEG nor PNG.
    """
    start = bytes(data[:8])
    for begin, pixel_format in _COMPRESSED_STARTS.items():
        if start.startswith(begin):
            return pixel_format
    if label.lower() in {"jpeg", "jpg", "png", ""} or not start:  # it should be one: spoiled, as playing it will say
        return PixelFormat.PNG if label.lower() == "png" else PixelFormat.MJPEG
    kind = next((name for begin, name in _OTHER_STARTS.items() if start.startswith(begin)), "")
    if start[8:12] == b"ftyp" or start[4:8] == b"ftyp":
        kind = "HEIC or AVIF"
    known = f"holds {kind}, " if kind else ""
    raise UnreadableEncodingError(f"{known}encoded as {label[:_MAX_LABEL]!r}; JPEG and PNG are read")


@dataclass(frozen=True, slots=True)
class RawForm:
    """What a message says of a raw image.

    Attributes:
        label: name of its encoding.
        size_px: width and height.
        step_bytes: bytes from one row to the next.
        is_big_endian: of pixels of 16 bits: whether the high byte comes first.
    """

    label: str
    size_px: tuple[int, int]
    step_bytes: int
    is_big_endian: bool


def raw_layout(form: RawForm, data: Buffer) -> RawLayout | PixelFormat:
    """Return how the bytes of a raw image lie.

    Args:
        form: what its message says of it. What the bytes contradict does not count.
        data: the image.

    Returns:
        The layout; an encoding of compressed images where the bytes are one of those.

    Raises:
        UnreadableEncodingError: the encoding is none that is read.
        BrokenMessageError: the image is too short for its size.
    """
    label, (width, height) = form.label, form.size_px
    encoding = ENCODINGS.get(label.lower().strip())
    if encoding is None:
        start = bytes(data[:8])
        for begin, pixel_format in _COMPRESSED_STARTS.items():
            if start.startswith(begin):
                return pixel_format
        raise UnreadableEncodingError(
            f"encoded as {label[:_MAX_LABEL]!r}; {', '.join(ENCODINGS)}, JPEG and PNG are read"
        )
    layout = RawLayout(
        encoding=encoding, width=width, height=height, step_bytes=form.step_bytes, is_big_endian=form.is_big_endian
    )
    if not width or not height or layout.rows * layout.row_bytes > len(data):
        if encoding.order is not Order.AS_IT_IS:
            raise BrokenMessageError("an image has fewer bytes than its size says")
        return replace(layout, step_bytes=layout.row_bytes)  # spoiled, as whoever decodes it will say
    step = _step(layout, len(data))
    if step >= 2 * layout.row_bytes and step - layout.row_bytes > _MAX_ALIGNMENT_BYTES:
        raise UnreadableEncodingError(
            f"encoded as {label[:_MAX_LABEL]!r}, of which {width} pixels take {layout.row_bytes} bytes and not {step}"
        )
    return replace(layout, step_bytes=step)


def _step(layout: RawLayout, size: int) -> int:
    """Return the bytes from row to row. The last row may lack its padding, and a step may be wrong or missing."""
    rows, row, step = layout.rows, layout.row_bytes, layout.step_bytes
    if step >= row and step * (rows - 1) + row <= size <= step * rows:
        return step
    return size // rows if size % rows == 0 else row


def frame_bytes(layout: RawLayout, data: Buffer) -> Buffer:
    """Return a raw image as a frame holds it.

    Args:
        layout: how its bytes lie.
        data: those bytes.

    Returns:
        Rows without padding, or a PNG file.
    """
    if layout.is_packed:
        return data[: layout.rows * layout.row_bytes]
    step, row = layout.step_bytes, layout.row_bytes
    content = bytes(data)
    if step != row:
        content = b"".join([content[at : at + row] for at in range(0, layout.rows * step, step)])
    else:
        content = content[: layout.rows * row]
    match layout.encoding.order:
        case Order.AS_IT_IS:
            made: bytes = content
        case Order.SWAPPED:
            made = _exchanged(content)
        case Order.GREY16:
            made = _png(layout, content if layout.is_big_endian else _exchanged(content), depth=16, channels=1)
        case Order.RGB:
            made = _png(layout, content)
        case Order.BGR:
            made = _png(layout, _picked(content, 3, (2, 1, 0)))
        case Order.RGBA:
            made = _png(layout, _picked(content, 4, (0, 1, 2)))
        case Order.BGRA:
            made = _png(layout, _picked(content, 4, (2, 1, 0)))
        case _:
            assert_never(layout.encoding.order)
    return made


def _exchanged(content: bytes) -> bytes:
    """Return bytes of which each two are exchanged."""
    out = bytearray(len(content))
    out[::2], out[1::2] = content[1::2], content[::2]
    return bytes(out)


def _picked(content: bytes, pixel_bytes: int, places: tuple[int, int, int]) -> bytes:
    """Return three bytes of each pixel, in this order."""
    out = bytearray(len(content) // pixel_bytes * 3)
    for channel, place in enumerate(places):
        out[channel::3] = content[place::pixel_bytes]
    return bytes(out)


def _png(layout: RawLayout, content: bytes, *, depth: int = 8, channels: int = 3) -> bytes:
    """Return a PNG file: grey (colour type 0) or red, green, blue (2), of which each row has the filter 0."""
    row = layout.width * channels * depth // 8
    rows = b"".join([b"\0" + content[at : at + row] for at in range(0, layout.height * row, row)])
    head = struct.pack(">IIBBBBB", layout.width, layout.height, depth, 2 if channels == 3 else 0, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b""))
    parts = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    ]
    return b"".join([b"\x89PNG\r\n\x1a\n", *parts])
