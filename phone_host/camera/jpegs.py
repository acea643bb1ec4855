"""Finds JPEG images in a byte stream by their own structure, and measures how irregularly they come. Sans-I/O: bytes in, images out, `now_ns` passed in.

What a server writes between images (multipart boundaries, part headers) is ignored: servers omit dashes, lengths and
line ends, announce one boundary and write another, and write the next boundary together with the image before it. A
JPEG itself says where it begins and ends: its segments carry their lengths, and in the entropy-coded data 0xFF is
always followed by 0 or a restart marker (ITU-T T.81, B.1.1.2 to B.1.1.5). So an image is returned with its last byte,
not one period later when the next part begins.

Some servers leave the end marker of every image out; browsers and ffmpeg show such images. After `_HABIT_IMAGES` of
them, with none that ends, an image is taken to end where the next part begins, and gets its end marker. So it comes one
period late, and whether its data were cut short is not known.

Rules: only whole images are returned. A broken image is reported once, and the search continues behind the fault, so
every byte is examined once. At most MAX_IMAGE_BYTES are kept.
"""

import re
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.frame import FrameFault
from common.imagesize.jpeg import FRAME_HEADERS
from common.protocol.wire import MAX_PAYLOAD_BYTES
from common.protocol.wire_fields import MAX_SIZE_PX

MAX_IMAGE_BYTES: Final = MAX_PAYLOAD_BYTES

_BEGIN: Final = b"\xff\xd8\xff"
"""SOI and the first byte of the next segment."""

_MARKER: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]", re.DOTALL)
"""Ends entropy-coded data: not a stuffed byte, a restart marker or a fill byte."""

_SOI, _EOI, _SOS = 0xD8, 0xD9, 0xDA

_HABIT_IMAGES: Final = 5
"""Number of images without an end marker, and none with one, that make it a habit of the server: a third of a second at 15 frames a second."""

_PART_HEAD: Final = re.compile(rb"\r?\n?--[\x20-\x7e]{1,200}\r?\n(?:[\x20-\x7e]{0,200}\r?\n){0,20}\Z")
"""A multipart boundary and the headers of the next part (RFC 2046, 5.1.1), right before an image."""

_PART_HEAD_BYTES: Final = 4096
_LEAST_CODE: Final = 0xC0
"""Codes below are reserved (Table B.1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Whole:
    """A whole image.

    Attributes:
        payload: bytes from SOI to EOI; the latter is added where a server never sends it.
        width_px: width from its frame header, px.
        height_px: height from its frame header, px.
        began_ns: when its first byte came.
        ended_ns: when its last byte came.
    """

    payload: bytes
    width_px: int
    height_px: int
    began_ns: int
    ended_ns: int


@dataclass(frozen=True, slots=True)
class Broken:
    """An image that began but is invalid."""

    fault: FrameFault


class _Phase(Enum):
    BETWEEN = 0
    SEGMENTS = 1
    ENTROPY = 2


class JpegStream:
    """Finds the images in one stream."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._phase = _Phase.BETWEEN
        self._at = 0
        self._size_px = (0, 0)
        self._began_ns = 0
        self._heard_ns = 0
        self._old_bytes = 0
        self._passed_bytes = 0
        self._has_scan = False  # this image has entropy-coded data
        self._endless_images = 0
        self._some_image_ended = False

    @property
    def held_bytes(self) -> int:
        """Number of bytes kept now."""
        return len(self._data)

    @property
    def passed_bytes(self) -> int:
        """Number of bytes so far that belonged to no whole image: headers, boundaries, broken images."""
        return self._passed_bytes

    def feed(self, data: bytes, now_ns: int) -> list[Whole | Broken]:
        """Take bytes as they come, in pieces of any size.

        Args:
            data: the bytes read.
            now_ns: when they were read, any steady clock, ns.

        Returns:
            Whole images and broken ones, in order.
        """
        self._old_bytes = len(self._data)
        self._data += data
        events: list[Whole | Broken] = []
        while self._step(now_ns, events):
            pass
        if len(self._data) > MAX_IMAGE_BYTES:
            self._give_up(len(self._data), events)
        self._heard_ns = now_ns
        return events

    def _step(self, now_ns: int, events: list[Whole | Broken]) -> bool:
        """Advance by one marker. Return whether there may be more to do."""
        match self._phase:
            case _Phase.BETWEEN:
                return self._seek(now_ns)
            case _Phase.SEGMENTS:
                return self._segment(now_ns, events)
            case _Phase.ENTROPY:
                return self._entropy()
            case _:
                assert_never(self._phase)

    def _seek(self, now_ns: int) -> bool:
        found = self._data.find(_BEGIN)
        if found < 0:
            self._drop(max(0, len(self._data) - len(_BEGIN) + 1))
            return False
        self._began_ns = self._heard_ns if found < self._old_bytes else now_ns
        self._drop(found)
        self._phase, self._at, self._size_px, self._has_scan = _Phase.SEGMENTS, 2, (0, 0), False
        return True

    def _segment(self, now_ns: int, events: list[Whole | Broken]) -> bool:  # noqa: PLR0911 - one return for each kind of marker
        """Handle the marker at `_at`."""
        data, at = self._data, self._at
        if len(data) < at + 4:
            return self._short(now_ns, events)
        code = data[at + 1]
        if code == _SOI and self._has_scan and data[at] == 0xFF:
            return self._next_began(now_ns, events)
        if data[at] != 0xFF or code < _LEAST_CODE or code == _SOI:
            return self._give_up(at, events)
        if code == 0xFF:  # a fill byte before a marker
            self._at += 1
            return True
        if code == _EOI:
            return self._end(now_ns, events)
        if 0xD0 <= code <= 0xD7:
            self._at += 2
            return True
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if length < 2:
            return self._give_up(at, events)
        if code in FRAME_HEADERS:
            if len(data) < at + 9:
                return False
            self._size_px = (int.from_bytes(data[at + 7 : at + 9], "big"), int.from_bytes(data[at + 5 : at + 7], "big"))
        self._at += 2 + length
        self._phase = _Phase.ENTROPY if code == _SOS else _Phase.SEGMENTS
        self._has_scan |= code == _SOS
        return True

    def _short(self, now_ns: int, events: list[Whole | Broken]) -> bool:
        """Handle fewer than four bytes: enough to recognise an end or an invalid marker."""
        data, at = self._data, self._at
        if len(data) > at and data[at] != 0xFF:
            return self._give_up(at, events)
        if len(data) > at + 1 and data[at + 1] == _EOI:
            return self._end(now_ns, events)
        return False

    def _entropy(self) -> bool:
        found = _MARKER.search(self._data, self._at)
        if found is None:
            self._at = max(self._at, len(self._data) - 1)
            return False
        self._phase, self._at = _Phase.SEGMENTS, found.start()
        return True

    def _end(self, now_ns: int, events: list[Whole | Broken]) -> bool:
        self._some_image_ended = True
        end = self._at + 2
        return self._deliver(bytes(self._data[:end]), end, now_ns, events)

    def _next_began(self, now_ns: int, events: list[Whole | Broken]) -> bool:
        """Handle the begin of the next image where this one has not ended."""
        self._endless_images += 1
        if self._some_image_ended or self._endless_images <= _HABIT_IMAGES:
            return self._give_up(self._at, events)
        whole = self._data[: self._at]
        head = _PART_HEAD.search(whole, max(0, self._at - _PART_HEAD_BYTES))
        payload = bytes(whole[: head.start() if head else self._at]) + bytes((0xFF, _EOI))
        return self._deliver(payload, self._at, now_ns, events)

    def _deliver(self, payload: bytes, count: int, now_ns: int, events: list[Whole | Broken]) -> bool:
        """Report a whole image, and go on behind the first `count` bytes."""
        width_px, height_px = self._size_px
        if not (1 <= width_px <= MAX_SIZE_PX and 1 <= height_px <= MAX_SIZE_PX):
            return self._give_up(count, events, FrameFault.WRONG_LENGTH)
        events.append(
            Whole(payload=payload, width_px=width_px, height_px=height_px, began_ns=self._began_ns, ended_ns=now_ns)
        )
        del self._data[:count]
        self._old_bytes = max(0, self._old_bytes - count)
        self._phase = _Phase.BETWEEN
        return True

    def _give_up(self, at: int, events: list[Whole | Broken], fault: FrameFault = FrameFault.NO_END) -> bool:
        """Report the broken image and continue behind the fault."""
        events.append(Broken(fault))
        self._drop(at)
        self._phase = _Phase.BETWEEN
        return True

    def _drop(self, count: int) -> None:
        self._passed_bytes += count
        self._old_bytes = max(0, self._old_bytes - count)
        del self._data[:count]


_ARRIVALS: Final = 61
"""Two seconds at 30 frames a second, short enough for a camera's clock to be steady."""

_LEAST_ARRIVALS: Final = 16


class Arrivals:
    """The recent arrivals."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=_ARRIVALS)

    def add(self, sequence: int, arrived_ns: int) -> None:
        """Take note of an image's arrival and its number in the stream."""
        self._seen.append((sequence, arrived_ns))

    def restart(self) -> None:
        """Take note that the stream begins anew."""
        self._seen.clear()

    @property
    def jitter_ns(self) -> int | None:
        """The images' 95th percentile of lateness relative to the fastest one, ns; None before 16 images.

        Lateness is measured against the least-squares line.
        """
        if len(self._seen) < _LEAST_ARRIVALS:
            return None
        count = len(self._seen)
        first_sequence, first_ns = self._seen[0]
        points = [(sequence - first_sequence, arrived_ns - first_ns) for sequence, arrived_ns in self._seen]
        middle_x, middle_y = (sum(values) / count for values in zip(*points, strict=True))
        over = sum((x - middle_x) * (y - middle_y) for x, y in points)
        under = sum((x - middle_x) ** 2 for x, _ in points)
        slope = over / under if under else 0.0
        late = sorted(y - slope * x for x, y in points)
        return round(late[count * 95 // 100] - late[0])
