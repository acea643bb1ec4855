"""One image of one camera with its header. Its bytes stay as the camera encoded them."""

from enum import Enum

from common.errors import DataError
from common.stamp import Stamp
from common.value import value

Buffer = bytes | bytearray | memoryview
"""Bytes that are passed on without a copy."""


class PixelFormat(Enum):
    """How a frame's bytes encode its image."""

    MJPEG = "mjpeg"
    PNG = "png"
    YUYV = "yuyv"
    GREY = "grey"
    NV12 = "nv12"


class FrameFault(Enum):
    """Why a frame is not what it claims to be, and is not used.

    flagged: its driver says so. stale: older than the stream. other_size: the size differs from the announced one. too_large: nobody asked for an
    image of that size. too_short: too few bytes for any image of that size. too_many_scans: more than any camera makes. corrupt: the decoder says so.
    turned: its camera was turned after the first frame. implausible_time: its stamp does not fit the frames before it, or says a time at which it was
    not there. clock_unknown: nothing tells yet, or any more, what its stamp means. unasked: more frames came than were asked for.
    """

    EMPTY = "empty"
    NO_START = "no_start"
    NO_END = "no_end"
    WRONG_LENGTH = "wrong_length"
    FLAGGED = "flagged"
    STALE = "stale"
    OTHER_SIZE = "other_size"
    TOO_LARGE = "too_large"
    TOO_SHORT = "too_short"
    TOO_MANY_SCANS = "too_many_scans"
    CORRUPT = "corrupt"
    TURNED = "turned"
    IMPLAUSIBLE_TIME = "implausible_time"
    CLOCK_UNKNOWN = "clock_unknown"
    UNASKED = "unasked"


class SpoiledImageError(DataError):
    """Raised for bytes that are not the whole image that they claim to be. The fault of whoever made or carried them; a stream goes on without it.

    Args:
        fault: the fault, for counters.
        problem: what is wrong, naming the image.
        remedy: what to do about it.
    """

    def __init__(self, fault: FrameFault, problem: str, remedy: str) -> None:
        super().__init__(problem, remedy)
        self.fault = fault


class ImageSizeError(SpoiledImageError):
    """Raised before decoding for an image whose size is implausible or too large. Its maker's fault, or the limit is too low."""


NOT_AS_SAID = frozenset(
    {FrameFault.OTHER_SIZE, FrameFault.TOO_LARGE, FrameFault.TOO_SHORT, FrameFault.TOO_MANY_SCANS, FrameFault.CORRUPT}
)
"""Faults of images that are not what their headers say. A camera or cable that cuts off an end never causes them."""


@value(kw_only=True)
class Frame:
    """One image and what the camera says about it.

    Attributes:
        sequence: number of this grab since the camera was opened, from 0. Every grab counts, even a spoiled one.
        exposed: exposure mid-point.
        grabbed: when it was dequeued from the driver, same clock as `exposed`.
        width_px: image width, px.
        height_px: image height, px.
        pixel_format: encoding of `payload`.
        exposure_ns: exposure time, ns; None if the camera does not report it.
        payload: the encoded image.
        uncertainty_ns: half-width of the error with which `exposed` was taken over from another clock, in 99.9 % of cases, ns; 0: it was not.
        bound_ns: the same for certain, whatever the delays were.
    """

    sequence: int
    exposed: Stamp
    grabbed: Stamp
    width_px: int
    height_px: int
    pixel_format: PixelFormat
    exposure_ns: int | None
    payload: Buffer
    uncertainty_ns: int = 0
    bound_ns: int = 0


_PADDING_BYTES = 256
"""Some webcams pad a JPEG with zeros after its end marker; more than this was never seen."""

_BRACKETS = {
    PixelFormat.MJPEG: (b"\xff\xd8", b"\xff\xd9"),
    PixelFormat.PNG: (b"\x89PNG\r\n\x1a\n", b"IEND\xae\x42\x60\x82"),
}
"""First and last bytes of a whole image: JPEG ITU-T T.81 B.1.1.3 (SOI, EOI); PNG 1.2, 3.1 and 3.4 (signature, IEND with its CRC)."""


_RAW_BITS = {PixelFormat.YUYV: 16, PixelFormat.GREY: 8, PixelFormat.NV12: 12}
"""Bits of one pixel of the raw formats, rows without padding: videodev2.h, V4L2_PIX_FMT_YUYV, _GREY, _NV12."""


def raw_bytes(pixel_format: PixelFormat, width_px: int, height_px: int) -> int | None:
    """Return the length of a raw image.

    Returns:
        Bytes; None for a compressed format.
    """
    bits = _RAW_BITS.get(pixel_format)
    return None if bits is None else bits * width_px * height_px // 8


def find_fault(pixel_format: PixelFormat, payload: Buffer, expected_bytes: int | None = None) -> FrameFault | None:
    """Check that encoded bytes begin and end as their format requires. The driver's error flag alone is not enough (DESIGN 5.5).

    Args:
        pixel_format: what the bytes claim to be.
        payload: the encoded image.
        expected_bytes: length of a raw image (`raw_bytes`, or more with padded rows); None: do not check.

    Returns:
        The fault, or None for a sound frame.
    """
    if not len(payload):
        return FrameFault.EMPTY
    if pixel_format in _RAW_BITS:
        return FrameFault.WRONG_LENGTH if expected_bytes is not None and len(payload) < expected_bytes else None
    start, end = _BRACKETS[pixel_format]
    if bytes(payload[: len(start)]) != start:
        return FrameFault.NO_START
    tail = bytes(payload[-_PADDING_BYTES:])
    if pixel_format is PixelFormat.MJPEG:
        tail = tail.rstrip(b"\0")
    return None if tail.endswith(end) else FrameFault.NO_END
