"""What a V4L2 camera offers, the choice among it, and how its buffers become payloads. Values only: no device is touched here."""

from collections.abc import Iterable, Iterator
from enum import Enum
from fractions import Fraction
from typing import Final

from common.errors import SettingsError, UnavailableError
from common.frame import PixelFormat
from common.value import value

PREFERENCE: Final = (
    ("MJPG", PixelFormat.MJPEG),
    ("JPEG", PixelFormat.MJPEG),
    ("YUYV", PixelFormat.YUYV),
    ("NV12", PixelFormat.NV12),
    ("GREY", PixelFormat.GREY),
)
"""Four letters of the supported formats, the best first: JPEG takes a tenth of the bytes, on the bus and on the link."""

_USUAL_PX: Final = (640, 480)
_USUAL_FPS: Final = Fraction(30)
_SAME_RATE: Final = Fraction(1, 100)
"""Rates are equal within this share: drivers count in 100 ns, and people write 30 for 29.97."""


_PARTS: Final = (2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Rates of a camera that takes any rate, as fractions of the requested one. The host's camera at that rate stays in step with them."""


@value()
class SizeRange:
    """Sizes that a scaling camera offers: minimum, maximum and step of width and height, px."""

    width_px: tuple[int, int, int]
    height_px: tuple[int, int, int]

    def holds(self, size_px: tuple[int, int]) -> bool:
        """Whether a size (width, height), px, is one of these."""
        return all(
            low <= value <= high and (value - low) % max(1, step) == 0
            for value, (low, high, step) in zip(size_px, (self.width_px, self.height_px), strict=True)
        )

    def within(self, size_px: tuple[int, int]) -> tuple[int, int]:
        """The largest of these sizes, px, that is neither wider nor higher than the given one. A side with no such length gets the shortest."""
        width, height = (
            low + max(0, min(value, high) - low) // max(1, step) * max(1, step)
            for value, (low, high, step) in zip(size_px, (self.width_px, self.height_px), strict=True)
        )
        return width, height


@value()
class Rates:
    """Frame rates of one size: named ones, or everything between two. Both are empty if the driver does not say.

    Attributes:
        named_hz: discrete rates, Hz, the highest first.
        between_hz: lowest and highest rate, Hz, or None.
    """

    named_hz: tuple[Fraction, ...] = ()
    between_hz: tuple[Fraction, Fraction] | None = None

    @property
    def highest_hz(self) -> Fraction | None:
        """The highest rate, Hz; None where unknown."""
        if self.named_hz:
            return self.named_hz[0]
        return self.between_hz[1] if self.between_hz else None

    def __str__(self) -> str:
        if self.named_hz:
            return ", ".join(rate_text(rate) for rate in self.named_hz)
        return " to ".join(rate_text(rate) for rate in self.between_hz) if self.between_hz else "unknown"


@value(kw_only=True)
class FormatOffer:
    """One encoding of a camera.

    Attributes:
        letters: its four letters.
        text: the driver's name for it.
        sizes_px: discrete sizes (width, height), px, in the driver's order.
        size_range: sizes of a scaling camera; None for a discrete one.
    """

    letters: str
    text: str
    sizes_px: tuple[tuple[int, int], ...]
    size_range: SizeRange | None = None

    def has(self, size_px: tuple[int, int]) -> bool:
        """Whether a size (width, height), px, is offered. A camera that names no sizes may have any."""
        if self.size_range is not None:
            return self.size_range.holds(size_px)
        return size_px in self.sizes_px or not self.sizes_px

    @property
    def sizes_text(self) -> str:
        """The sizes as people write them."""
        if self.size_range is not None:
            (w0, w1, _), (h0, h1, _) = self.size_range.width_px, self.size_range.height_px
            return f"{w0}x{h0} to {w1}x{h1}"
        return ", ".join(f"{width}x{height}" for width, height in self.sizes_px) or "any"


@value()
class Wanted:
    """The user's wishes for the encoding; None: whatever is best.

    Attributes:
        size_px: (width, height), px.
        fps: frames per second.
        pixel_format: encoding.
    """

    size_px: tuple[int, int] | None = None
    fps: Fraction | None = None
    pixel_format: PixelFormat | None = None


@value()
class Choice:
    """An encoding and size that the camera offers.

    Attributes:
        letters: four letters of the format.
        pixel_format: our name for it.
        size_px: (width, height), px.
    """

    letters: str
    pixel_format: PixelFormat
    size_px: tuple[int, int]


def rate_text(rate_hz: Fraction) -> str:
    """A rate as people write it: 30, 29.97, 7.5."""
    return f"{float(rate_hz):.2f}".rstrip("0").rstrip(".")


def choose(offers: tuple[FormatOffer, ...], wanted: Wanted, camera: str) -> Choice:
    """Choose encoding and size.

    Returns:
        The first fitting format in the order of PREFERENCE. Without a requested size: 640x480, otherwise the largest below it, otherwise the smallest.

    Raises:
        UnavailableError: the camera has no supported format (only H.264, say).
        SettingsError: it lacks what is requested; the message lists what it has.
    """
    by_letters = {offer.letters: offer for offer in offers}
    known = [(by_letters[letters], kind) for letters, kind in PREFERENCE if letters in by_letters]
    listed = ", ".join(offer.letters for offer in offers)
    if not offers:
        raise UnavailableError(
            f"camera {camera} offers no format at the moment", "plug it in again, or start what feeds it"
        )
    if not known:
        raise UnavailableError(
            f"camera {camera} has only {listed}, which cannot be sent frame by frame",
            "use a camera with MJPEG, YUYV, NV12 or GREY",
        )
    if wanted.pixel_format is not None:
        known = [(offer, kind) for offer, kind in known if kind is wanted.pixel_format]
        if not known:
            raise SettingsError(
                f"camera {camera} has no format {wanted.pixel_format.value}", f"give one of its formats: {listed}"
            )
    if wanted.size_px is None:
        offer, kind = known[0]
        return Choice(offer.letters, kind, _usual_size(offer))
    for offer, kind in known:
        if offer.has(wanted.size_px):
            return Choice(offer.letters, kind, wanted.size_px)
    width, height = wanted.size_px
    offer, kind = known[0]
    raise SettingsError(
        f"camera {camera} has no size {width}x{height} in {kind.value}", f"give one of its sizes: {offer.sizes_text}"
    )


def choose_rate(rates: Rates, wanted: Wanted, camera: str) -> Fraction:
    """Choose the frame rate.

    Returns:
        The rate, Hz. Without a wish: the highest up to 30, or the lowest there is.

    Raises:
        SettingsError: the requested rate is not offered; the message lists those that are.
    """
    if wanted.fps is None:
        if rates.named_hz:
            return next((rate for rate in rates.named_hz if rate <= _USUAL_FPS * (1 + _SAME_RATE)), rates.named_hz[-1])
        low, high = rates.between_hz or (_USUAL_FPS, _USUAL_FPS)
        return max(low, min(high, _USUAL_FPS))
    fps = wanted.fps
    if rates.between_hz is not None and not rates.named_hz:
        low, high = rates.between_hz
        if low * (1 - _SAME_RATE) <= fps <= high * (1 + _SAME_RATE):
            return max(low, min(high, fps))
    elif not rates.named_hz:
        return fps
    for rate in rates.named_hz:
        if abs(rate - fps) <= fps * _SAME_RATE:
            return rate
    raise SettingsError(f"camera {camera} has no rate {rate_text(fps)} at that size", f"give one of its rates: {rates}")


def slower_rates(rates: Rates, present_hz: Fraction) -> tuple[Fraction, ...]:
    """Return the rates to which a camera can be slowed down.

    Returns:
        Rates below that, Hz, the highest first. For a camera that takes any rate between two: fractions of the current one.
    """
    if rates.named_hz:
        return tuple(rate for rate in rates.named_hz if rate < present_hz * (1 - _SAME_RATE))
    low_hz = rates.between_hz[0] if rates.between_hz else present_hz
    return tuple(present_hz / part for part in _PARTS if present_hz / part >= low_hz)


def has_rates(rates: Rates, wanted_hz: Iterable[Fraction]) -> bool:
    """Whether each of these rates, Hz, is offered."""
    for rate_hz in wanted_hz:
        try:
            choose_rate(rates, Wanted(fps=rate_hz), "")
        except SettingsError:
            return False
    return True


def smaller_sizes(offer: FormatOffer, size_px: tuple[int, int]) -> tuple[tuple[int, int], ...]:
    """Return the smaller sizes of exactly the same shape.

    Args:
        offer: the encoding to search.
        size_px: current (width, height), px.

    Returns:
        (width, height), px, the largest first. For a scaling camera: the halves, thirds and quarters that it offers.
    """
    width, height = size_px
    if offer.size_range is not None:
        parts = [(width // part, height // part) for part in (2, 3, 4)]
        named = [size for size in parts if offer.size_range.holds(size)]
    else:
        named = list(offer.sizes_px)
    return tuple(sorted({(w, h) for w, h in named if w < width and w * height == h * width}, reverse=True))


def _usual_size(offer: FormatOffer) -> tuple[int, int]:
    if offer.has(_USUAL_PX):
        return _USUAL_PX
    if offer.size_range is not None:
        return offer.size_range.within(_USUAL_PX)
    smaller = [size for size in offer.sizes_px if _area(size) <= _area(_USUAL_PX)]
    return max(smaller, key=_area) if smaller else min(offer.sizes_px, key=_area)


def _area(size_px: tuple[int, int]) -> int:
    return size_px[0] * size_px[1]


@value(kw_only=True)
class PixelFormatSet:
    """The format that the driver actually set.

    Attributes:
        letters: the format's four letters.
        size_px: (width, height), px.
        row_bytes: distance from one row to the next, bytes; 0 for compressed formats.
        image_bytes: maximum size of one image, bytes.
    """

    letters: str
    size_px: tuple[int, int]
    row_bytes: int
    image_bytes: int


class SendPart(Enum):
    """What is sent of a raw image."""

    WHOLE = "whole"
    LUMA = "luma"


@value()
class Packing:
    """How a camera's buffers become payloads.

    Attributes:
        source: encoding in the buffer.
        sent_as: encoding of the payload.
        width_px: image width, px.
        height_px: image height, px.
        row_bytes: distance from one row to the next, bytes; 0 for compressed images.
    """

    source: PixelFormat
    sent_as: PixelFormat
    width_px: int
    height_px: int
    row_bytes: int

    @classmethod
    def of(cls, made: PixelFormatSet, source: PixelFormat, part: SendPart) -> "Packing":
        """Make the packing for a format. JPEG's luma cannot be taken without decoding, so JPEG is always sent whole."""
        if source in {PixelFormat.MJPEG, PixelFormat.PNG}:
            return cls(source, source, *made.size_px, 0)
        sent_as = PixelFormat.GREY if part is SendPart.LUMA else source
        pixel_bytes = 2 if source is PixelFormat.YUYV else 1
        return cls(source, sent_as, *made.size_px, max(made.row_bytes, pixel_bytes * made.size_px[0]))

    @property
    def least_bytes(self) -> int | None:
        """A shorter buffer cannot hold a whole image; None for compressed images."""
        if not self.row_bytes:
            return None
        return (self._rows - 1) * self.row_bytes + self._used_row_bytes

    def pack(self, view: memoryview) -> bytes:
        """Copy an image out of its buffer.

        Args:
            view: the buffer's content, at least `least_bytes` long.

        Returns:
            The payload.
        """
        if not self.row_bytes:
            return bytes(view)
        luma_only = self.sent_as is not self.source
        step = 2 if luma_only and self.source is PixelFormat.YUYV else 1
        rows = self.height_px if luma_only else self._rows
        if self.row_bytes == self._used_row_bytes:
            whole = bytes(view[: rows * self.row_bytes])
            # Luma of YUYV is copied twice: slicing bytes with a step takes 0.08 ms for 640x480, a memoryview 1.1 ms (x86).
            return whole if step == 1 else whole[::step]
        return b"".join(self._padded_rows(view, rows, step))

    @property
    def _rows(self) -> int:
        """Rows in the buffer. NV12 has its colours below, at half the height, in rows of the same length."""
        return self.height_px * 3 // 2 if self.source is PixelFormat.NV12 else self.height_px

    @property
    def _used_row_bytes(self) -> int:
        return self.width_px * (2 if self.source is PixelFormat.YUYV else 1)

    def _padded_rows(self, view: memoryview, rows: int, step: int) -> Iterator[bytes]:
        for row in range(rows):
            start = row * self.row_bytes
            yield bytes(view[start : start + self._used_row_bytes])[::step]
