"""Reads the fields of a header in order, checking each for type and range. No I/O."""

from dataclasses import replace
from enum import Enum
from typing import Any, Final, TypeVar

from common.camera_identity import LARGEST_LOCK, MOST_LETTERS, CameraIdentity, Lock
from common.errors import ProtocolError
from common.frame import PixelFormat
from common.orientation import Flip, Orientation
from common.protocol.message import BoardCounts, CameraDescription, DropReason, Locks, Pacing, Rung, Steering

MAX_SIZE_PX: Final = 16384
"""Largest width and height of a frame, px: well beyond any camera. Their product fits into 28 bits."""

MAX_TEXT: Final = 96
MAX_COUNT: Final = 2**53
MOST_NS: Final = 2**62
"""146 years in ns: no honest clock is further from its zero. Keeps sums within 64 bits."""

MAX_PERIOD_NS: Final = 3_600_000_000_000
"""One frame an hour. The period decides what counts as a pair, so it is believed only as far as the result is still a stream."""

PIXEL_FORMATS: Final = tuple(PixelFormat)
DROP_REASONS: Final = tuple(DropReason)
FLIPS: Final = tuple(Flip)
LOCKS: Final = tuple(Lock)

E = TypeVar("E", bound=Enum)


def bad_field(problem: str) -> ProtocolError:
    """Make the error for a field that is not believed."""
    return ProtocolError(problem, "the packet is dropped; check what else talks to this address")


class FieldReader:
    """Takes checked fields off a header, front to back."""

    def __init__(self, items: list[Any], at: int = 0) -> None:
        self._items = items
        self._at = at

    def finish(self) -> None:
        """Check that nothing is left over."""
        if self._at != len(self._items):
            raise bad_field(f"{len(self._items) - self._at} fields too many")

    def count(self) -> int:
        """A number of things."""
        return self._integer(0, MAX_COUNT)

    def time_ns(self) -> int:
        """A moment on some clock, ns."""
        return self._integer(-MOST_NS, MOST_NS)

    def later_ns(self) -> int:
        """A duration, ns."""
        return self._integer(0, MOST_NS)

    def size_px(self) -> int:
        """A width or a height, px."""
        return self._integer(1, MAX_SIZE_PX)

    @property
    def has_more(self) -> bool:
        """Whether there is another field."""
        return self._at < len(self._items)

    def text(self, most: int = MAX_TEXT) -> str:
        """A short text."""
        value = self._next()
        if type(value) is not str or len(value) > most:
            raise bad_field(f"field {self._at} is not a short text")
        return value

    def enum(self, kind: type[E]) -> E:
        """A member of an enum with integer values."""
        try:
            return kind(self._integer(0, MAX_COUNT))
        except ValueError:
            raise bad_field(f"field {self._at} is no {kind.__name__}") from None

    def choice(self, options: tuple[E, ...]) -> E:
        """One of these options, by its index."""
        return options[self._integer(0, len(options) - 1)]

    def camera(self) -> CameraDescription:
        """A board's description of its camera."""
        name, width_px, height_px = self.text(), self.size_px(), self.size_px()
        return CameraDescription(
            name=name,
            width_px=width_px,
            height_px=height_px,
            pixel_format=self.choice(PIXEL_FORMATS),
            period_ns=self._integer(1, MAX_PERIOD_NS),
            pacing=self.enum(Pacing),
            steering=self.enum(Steering),
        )

    def more_of(self, camera: CameraDescription) -> CameraDescription:
        """The list that ends a long hello. What follows the fields known here comes from a later version and is ignored."""
        inner = FieldReader(self._list())
        orientation = Orientation(90 * inner._integer(0, 3), inner.choice(FLIPS))
        driver, name, serial = (inner.text(MOST_LETTERS) for _ in range(3))
        identity = CameraIdentity(driver, name, serial)
        return replace(camera, orientation=orientation, identity=identity, controls=inner.locks())

    def locks(self) -> Locks:
        """Controls with their values. Controls that only a later version knows are left out."""
        flat = self._list()
        if len(flat) % 2:
            raise bad_field(f"field {self._at} is no list of controls")
        inner, found = FieldReader(flat), {}
        for _ in range(len(flat) // 2):
            number, value = inner.count(), inner._integer(-LARGEST_LOCK - 1, LARGEST_LOCK)
            if number < len(LOCKS):
                found[LOCKS[number]] = value
        return tuple(found.items())

    def counts(self) -> BoardCounts:
        """A board's account."""
        grabbed, sent, flat = self.count(), self.count(), self._list()
        if len(flat) % 2:
            raise bad_field(f"field {self._at} is no list of drops")
        inner = FieldReader(flat)
        return BoardCounts(
            grabbed, sent, tuple((inner.choice(DROP_REASONS), inner.count()) for _ in range(len(flat) // 2))
        )

    def rung(self) -> Rung:
        """How far a board has lowered its camera's output."""
        index, last, changes, period_ns = self.count(), self.count(), self.count(), self._integer(1, MAX_PERIOD_NS)
        quality, width_px, height_px = self.count(), self._integer(0, MAX_SIZE_PX), self._integer(0, MAX_SIZE_PX)
        return Rung(
            index=index,
            last=last,
            changes=changes,
            period_ns=period_ns,
            quality=quality,
            width_px=width_px,
            height_px=height_px,
        )

    def _list(self) -> list[Any]:
        value = self._next()
        if not isinstance(value, list):
            raise bad_field(f"field {self._at} is no list")
        return value

    def _next(self) -> Any:  # noqa: ANN401 - whatever msgpack found; every caller checks it
        if self._at >= len(self._items):
            raise bad_field("fields are missing")
        self._at += 1
        return self._items[self._at - 1]

    def _integer(self, low: int, high: int) -> int:
        at = self._at
        if at >= len(self._items):
            raise bad_field("fields are missing")
        self._at = at + 1
        value = self._items[at]
        if type(value) is not int or not low <= value <= high:  # to isinstance, a bool is an int
            raise bad_field(f"field {self._at} is no integer in {low}..{high}")
        return int(value)
