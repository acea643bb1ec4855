"""What the page's server gives a browser's camera to, played: it keeps what came, and says what a test wants it to say."""

import json
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from common import now
from phone_host.web.source import Line

T = TypeVar("T")

HEADER = struct.Struct("<BBHHHIIdddddII")
SESSION = "5e55"
BUSY = {"problem": "another browser is the camera", "remedy": "stop it there, or close its page"}


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame as it came; stamps in us on the browser's line, arrival on this machine's.

    Attributes:
        payload: JPEG, or luma.
        received_ns: CLOCK_MONOTONIC.
    """

    is_luma: bool
    rotation: int
    width: int
    height: int
    sequence: int
    dropped: int
    timestamp_us: float
    capture_us: float
    callback_us: float
    encoded_us: float
    sent_us: float
    exposure_us: int
    payload: bytes
    received_ns: int


@dataclass
class PlayedFeed:
    """Implements `Feed`: what the real server hands a browser's two lines to.

    Attributes:
        welcome: what a browser is told first, beside the session.
        window: frames that may be under way; None: nothing is granted but by `grant`.
        frames: that came, newest last.
        said: texts that came, but for echoes.
        offsets_us: of each echo: round trip, and this machine's clock minus the browser's.
        is_away: whether it hangs up on whoever comes.
    """

    welcome: dict[str, Any] = field(default_factory=lambda: {"want": {}, "locks": None})
    window: int | None = 4
    frames: list[Frame] = field(default_factory=list)
    said: list[dict[str, Any]] = field(default_factory=list)
    offsets_us: list[tuple[float, float]] = field(default_factory=list)
    is_away: bool = False

    def __post_init__(self) -> None:
        """Begin without a browser."""
        self._seat: Line | None = None
        self._changed = threading.Condition()

    def camera(self, line: Line, hello: str) -> "_Camera | None":
        """See Feed."""
        if self.is_away:
            line.close()
            return None
        self.note(self.said, json.loads(hello))
        if self._seat is not None:
            line.say(json.dumps({"kind": "refused"} | BUSY))
            line.close()
            return None
        self._seat = line
        line.say(json.dumps({"kind": "welcome", "session": SESSION} | self.welcome))
        if self.window:
            self.grant(self.window)
        return _Camera(self)

    def clock(self, line: Line, hello: str) -> "_Clock":
        """See Feed."""
        del line
        assert json.loads(hello) == {"kind": "hello", "session": SESSION}
        return _Clock(self)

    def until(self, holds: Callable[[], object]) -> None:
        """Wait until something holds, up to a minute."""
        with self._changed:
            assert self._changed.wait_for(holds, 60), self.said[-3:]

    def of_kind(self, kind: str) -> list[dict[str, Any]]:
        """All texts of a kind that came."""
        return [each for each in self.said if each["kind"] == kind]

    def tell(self, **message: Any) -> None:
        """Say something to the browser that feeds."""
        assert self._seat is not None
        self._seat.say(json.dumps(message))

    def grant(self, count: int) -> None:
        """Let the browser send until it has sent so many on this connection."""
        self.tell(kind="credit", up_to=count)

    def hang_up(self) -> None:
        """Close the connection."""
        assert self._seat is not None
        self._seat.close()

    def left(self) -> None:
        """The browser that fed is gone."""
        self._seat = None

    def note(self, notes: list[T], item: T) -> None:
        """Keep something that came."""
        with self._changed:
            notes.append(item)
            self._changed.notify_all()


@dataclass
class _Camera:
    """A browser's first line."""

    feed: PlayedFeed
    count: int = 0

    def heard(self, said: str | bytes, now_ns: int) -> str:
        """See Hearer."""
        if isinstance(said, str):
            self.feed.note(self.feed.said, json.loads(said))
            return ""
        self.count += 1
        self.feed.note(self.feed.frames, _frame(said, now_ns))
        return json.dumps({"kind": "credit", "up_to": self.count + self.feed.window}) if self.feed.window else ""

    def left(self) -> None:
        """See Hearer."""
        self.feed.left()


@dataclass
class _Clock:
    """A browser's second line."""

    feed: PlayedFeed
    marks: dict[int, tuple[int, int]] = field(default_factory=dict)

    def heard(self, said: str | bytes, now_ns: int) -> str:
        """See Hearer."""
        word = json.loads(said)
        if word["kind"] == "echo":
            self.marks[word["n"]] = (now_ns, now.monotonic_ns())
            t1, t2 = (str(mark) for mark in self.marks[word["n"]])
            return json.dumps(word | {"t1": t1, "t2": t2})
        first, second = (mark / 1000 for mark in self.marks.pop(word["n"]))
        trip = (word["t3"] - word["t0"]) - (second - first)
        self.feed.note(self.feed.offsets_us, (trip, ((first - word["t0"]) + (second - word["t3"])) / 2))
        return ""

    def left(self) -> None:
        """See Hearer."""


def _frame(message: bytes, received_ns: int) -> Frame:
    version, encoding, *values, reserved = HEADER.unpack_from(message)
    assert (version, reserved) == (1, 0)
    return Frame(encoding == 1, *(*values, message[HEADER.size :], received_ns))
