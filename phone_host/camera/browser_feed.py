"""The seat of the one browser that gives its camera: it comes, says hello, feeds and leaves, whether anybody uses it or not.

The page's server brings a browser's two WebSockets here (`camera`, `clock`); a `BrowserCamera` sits on the other side while
a run uses the camera. Methods are called from any thread and return at once; one lock protects everything.
"""

import logging
import threading
from dataclasses import dataclass, field
from typing import Final, Protocol

from common import now
from common.program.logs import event
from common.protocol.message import Locks
from phone_host.camera.browser_clock import BrowserClock
from phone_host.camera.browser_locks import groups_of
from phone_host.camera.browser_wire import (
    IDLE_TEXT,
    Bye,
    EchoAsked,
    EchoHeard,
    Groups,
    Hello,
    Locked,
    TrackState,
    credit_text,
    echo_text,
    lock_text,
    read_word,
    refused_text,
    session_named,
    told_text,
    want_text,
    welcome_text,
)
from phone_host.camera.uris import BrowserSettings

_LOG = logging.getLogger(__name__)

_SILENT_NS: Final = 3_000_000_000
"""A browser says something every second. One that does not is gone, and another may take its seat: itself, come back."""

_LEAST_WINDOW, _MOST_WINDOW = 2, 8
"""Frames under way: one is being encoded while one is being sent, and more where the way is long."""

_MOST_UNASKED: Final = 30
"""So many frames beyond its credit, and a browser is sent away."""

_ANSWER_S: Final = 1.5
"""A phone sets a control within a few frames."""


class Line(Protocol):
    """One WebSocket of a browser."""

    @property
    def is_near(self) -> bool:
        """Whether it comes from this machine, as far as its address tells."""

    def say(self, text: str) -> None:
        """Send a text, soon. Safe from any thread."""

    def close(self) -> None:
        """Close it after what was said. Safe from any thread."""


@dataclass(slots=True, eq=False)
class Seat:
    """The browser that feeds.

    Attributes:
        line: its first WebSocket.
        hello: what it said.
        clock: its clock.
        session: what its clock socket names.
        heard_ns: when it said anything last.
        wanted: what it was told to give.
        received: frames that have come over this line.
        granted: frames that may come over it.
        is_live: whether its camera gives images.
        words: what it says about that.
        groups: what its camera is held at.
        answers: how often it has said that.
    """

    line: Line
    hello: Hello
    clock: BrowserClock
    heard_ns: int
    wanted: BrowserSettings
    session: str = field(default_factory=now.random_id)
    received: int = 0
    granted: int = 0
    is_live: bool = True
    words: str = ""
    groups: Groups = field(default_factory=dict)
    answers: int = 0


class User(Protocol):
    """Who uses the camera. Called with the feed's lock held."""

    @property
    def settings(self) -> BrowserSettings:
        """What it wants."""

    def takes(self, hello: Hello) -> bool:
        """Whether it takes images of this camera."""

    def came(self, seat: Seat, now_ns: int) -> None:
        """A browser has taken the seat, or its camera has come to life."""

    def left(self, now_ns: int) -> None:
        """It has left, or its camera has died."""

    def frame(self, seat: Seat, data: bytes, arrived_ns: int, *, is_asked: bool) -> None:
        """A frame has come."""


class BrowserFeed:
    """The seat. It lives as long as the page.

    Args:
        patience_ns: how long a run waits for a browser's first images, ns; None: for ever.
    """

    def __init__(self, patience_ns: int | None) -> None:
        self.patience_ns: Final = patience_ns
        self.changed: Final = threading.Condition()
        self.seat: Seat | None = None
        self.has_ended = False
        self._user: User | None = None
        self._last: Seat | None = None
        self._locks: Groups = {}

    @property
    def words(self) -> str:
        """What there is to know of the browser that feeds; empty: there is none."""
        with self.changed:
            seat = self.seat
            if seat is None:
                return ""
            name = seat.hello.identity.name or "its camera"
            return f"a browser gives {name}" + (f" ({seat.words})" if seat.words else "")

    # The page's server.

    def camera(self, line: Line, hello: str) -> "CameraLine | None":
        """A browser wants to give its camera.

        Returns:
            What takes the following messages; None: it was refused, and told why.
        """
        said, now_ns = read_word(hello), now.monotonic_ns()
        if not isinstance(said, Hello) or said.is_other_version:
            line.say(refused_text("this page is older or newer than phone-host", "reload the page"))
            line.close()
            return None
        with self.changed:
            if (refusal := self._refusal(said, now_ns)) is not None:
                line.say(refused_text(*refusal))
                line.close()
                return None
            known = (
                self._last if self._last is not None and said.track and said.track == self._last.hello.track else None
            )
            clock = BrowserClock(said.resolution_ns) if known is None else known.clock
            wanted = BrowserSettings() if self._user is None else self._user.settings
            seat = Seat(line, said, clock, now_ns, wanted)
            if known is not None:
                seat.groups = known.groups
            self.seat = self._last = seat
            line.say(welcome_text(seat.session, wanted, {} if self._user is None else self._locks))
            _LOG.info(event("browser_came", camera=said.identity.name or "unnamed"))
            if self._user is not None:
                self._user.came(seat, now_ns)
            self.changed.notify_all()
        return CameraLine(self, seat)

    def clock(self, line: Line, hello: str) -> "ClockLine | None":
        """A browser's clock socket has begun.

        Args:
            line: its WebSocket.
            hello: its first message; it names the session.

        Returns:
            What takes the following messages; None: nobody has that session.
        """
        with self.changed:
            seat = self.seat
            if seat is None or session_named(hello) != seat.session:
                line.close()
                return None
            return ClockLine(self, seat)

    # Who uses the camera. Called with the lock held.

    def attach(self, user: User, now_ns: int) -> None:
        """Use the camera from now on, instead of whoever does."""
        before, self._user, self._locks = self._user, user, {}
        if before is not None:
            before.left(now_ns)
        seat = self.seat
        if seat is None:
            return
        if seat.wanted != user.settings:
            seat.wanted = user.settings
            seat.line.say(want_text(user.settings))
        user.came(seat, now_ns)

    def detach(self, user: User) -> None:
        """Use it no more."""
        if self._user is user:
            self._user = None
            self.rest()
            self.tell("")

    def grant(self, period_ns: int) -> None:
        """Let frames come: those that are under way at once, and no more.

        Args:
            period_ns: time between two frames, ns; 0: unknown.
        """
        seat = self.seat
        if seat is None:
            return
        under_way = seat.clock.round_trip_ns // period_ns if period_ns else 0
        up_to = seat.received + min(_MOST_WINDOW, _LEAST_WINDOW + under_way)
        if up_to > seat.granted:
            seat.granted = up_to
            seat.line.say(credit_text(up_to))

    def rest(self) -> None:
        """Let the browser know that nobody needs frames now."""
        if self.seat is not None:
            self.seat.line.say(IDLE_TEXT)

    def tell(self, words: str) -> None:
        """Say something to the browser's user; empty: nothing any more."""
        if self.seat is not None:
            self.seat.line.say(told_text(words))

    def hold(self, locks: Locks) -> None:
        """Have the camera held at values, now and whenever it comes back; wait a moment for its answer."""
        self._locks = groups_of(locks)
        seat = self.seat
        if seat is not None and self._locks:
            answers = seat.answers
            seat.line.say(lock_text(self._locks))
            self.changed.wait_for(lambda: self.seat is not seat or seat.answers > answers, _ANSWER_S)

    def end(self) -> None:
        """Nobody shall wait for a browser any more."""
        with self.changed:
            self.has_ended = True
            self.changed.notify_all()

    # What browsers say.

    def heard(self, seat: Seat, said: str | bytes, now_ns: int) -> None:
        """Take a message of the first WebSocket."""
        with self.changed:
            if self.seat is not seat:
                return
            seat.heard_ns = now_ns
            if isinstance(said, bytes):
                self._frame(seat, said, now_ns)
            else:
                self._word(seat, said, now_ns)
            self.changed.notify_all()

    def left(self, seat: Seat) -> None:
        """The first WebSocket has ended."""
        with self.changed:
            if self.seat is seat:
                self._leave(now.monotonic_ns())

    def _refusal(self, hello: Hello, now_ns: int) -> tuple[str, str] | None:
        """Return why a browser cannot have the seat, and what to do. If it can, because the one before is silent or itself, free it."""
        if self._user is not None and not self._user.takes(hello):
            return "the run began with another camera", "stop the run first, or start that camera again"
        seat = self.seat
        if seat is None:
            return None
        is_same = bool(hello.track) and hello.track == seat.hello.track
        if not is_same and now_ns - seat.heard_ns < _SILENT_NS:
            return "another browser gives its camera", "stop it there, or close that page"
        seat.line.say(refused_text("another browser gives its camera now", "stop it there, or close that page"))
        seat.line.close()
        self._leave(now_ns)
        return None

    def _leave(self, now_ns: int) -> None:
        self.seat = None
        _LOG.info(event("browser_left"))
        if self._user is not None:
            self._user.left(now_ns)
        self.changed.notify_all()

    def _frame(self, seat: Seat, data: bytes, now_ns: int) -> None:
        seat.received += 1
        excess = seat.received - seat.granted
        if self._user is not None:
            self._user.frame(seat, data, now_ns, is_asked=excess <= 0)
        if excess > _MOST_UNASKED:
            seat.line.say(refused_text("more frames came than were asked for", "reload the page"))
            seat.line.close()

    def _word(self, seat: Seat, text: str, now_ns: int) -> None:
        match read_word(text):
            case TrackState(is_live=is_live, words=words):
                was_live, seat.is_live, seat.words = seat.is_live, is_live, words
                if self._user is not None and was_live != is_live:
                    (self._user.came(seat, now_ns) if is_live else self._user.left(now_ns))
            case Locked(groups):
                seat.groups, seat.answers = {**seat.groups, **groups}, seat.answers + 1
            case Bye(words):
                seat.words = words
                seat.line.close()
            case _:
                pass


@dataclass(frozen=True, slots=True, eq=False)
class CameraLine:
    """A browser's first WebSocket: frames, and what becomes of its camera."""

    feed: BrowserFeed
    seat: Seat

    def heard(self, said: str | bytes, now_ns: int) -> str:
        """Take a message that came at `now_ns`; answer nothing (see web.source.Hearer)."""
        self.feed.heard(self.seat, said, now_ns)
        return ""

    def left(self) -> None:
        """The WebSocket has ended."""
        self.feed.left(self.seat)


@dataclass(frozen=True, slots=True, eq=False)
class ClockLine:
    """A browser's second WebSocket: clock echoes."""

    feed: BrowserFeed
    seat: Seat

    def heard(self, said: str | bytes, now_ns: int) -> str:
        """Take a message that came at `now_ns`; return what to answer at once (see web.source.Hearer)."""
        word = read_word(said) if isinstance(said, str) else None
        with self.feed.changed:
            self.seat.heard_ns = now_ns
            if isinstance(word, EchoAsked):
                t2_ns = now.monotonic_ns()
                self.seat.clock.asked(word, now_ns, t2_ns)
                return echo_text(word, now_ns, t2_ns)
            if isinstance(word, EchoHeard):
                self.seat.clock.heard(word)
        return ""

    def left(self) -> None:
        """The WebSocket has ended."""
