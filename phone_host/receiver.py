"""The host's end of the link in a thread of its own: session, clock estimate, credit. Frames go to the pair queue with all marks set."""

import logging
import math
import os
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final, Protocol

import zmq

from common import now
from common.errors import ProtocolError
from common.link.base import Broken, Garbage, Incoming, Link, Packet
from common.logs import event
from common.protocol.host_session import HostSession
from common.protocol.message import BoardCounts, BoardHello, FrameMessage, Pacing, RefusalReason
from common.protocol.session import (
    Accepted,
    Arrived,
    Counted,
    Echo,
    Outgoing,
    Output,
    Refused,
    Stale,
    Vanished,
)
from common.protocol.wire import VersionError, decode, encode_stamped
from phone_host.model import BoardFrame
from phone_host.pairqueue import PairQueue
from phone_host.sync.clock import ClockEstimate, ClockEstimator

_LOG = logging.getLogger(__name__)

_LONGEST_WAIT_MS: Final = 50
"""The pair queue's patience is checked at least this often."""

_MOST_UNDER_WAY: Final = 4
"""Frames under way at most, however long the link: more would only be older."""

_UNKNOWN_NS: Final = 2**62
"""Transit time of a frame before the first one has come: no link is taken for swift before it was measured."""

_SWIFT: Final = 4
"""A link is swift while a frame takes less than this part of a period: then it has come before the next one is grabbed."""


_FAREWELL_NS: Final = 300_000_000
"""How long a leaving host waits for the board's last account: a few round trips of any usable link."""

_REFUSAL_NS: Final = 1_000_000_000
"""A board that refuses does so at every hello, five times a second; one that has not done so for this long is gone."""


class BoardListener(Protocol):
    """Who is told of the board by the receiver's thread."""

    def session_began(self) -> None:
        """A life of the board begins; nothing of the one before will follow."""

    def frame_arrived(self, exposed_ns: int, index: int | None) -> None:
        """A frame has come: its exposure on the host's clock, and its number if the board shows images on demand."""


@dataclass(slots=True)
class SessionAccount:
    """One life of a board as the host saw it; closed accounts are kept for the report.

    Attributes:
        session: the board's session id.
        first: the board's account when this host was accepted.
        latest: the board's newest account.
        received: frames that came.
        lost: frames that were sent and never came (gaps).
        duplicate: frames that a transport delivered again, dropped.
        old_session: frames of an older life of the board, dropped.
        ended: whether the board said that no frame follows.
        vanished: whether the board went without a word: what it sent after `latest` is unknown.
    """

    session: str
    first: BoardCounts
    latest: BoardCounts
    received: int = 0
    lost: int = 0
    duplicate: int = 0
    old_session: int = 0
    ended: bool = False
    vanished: bool = False


@dataclass(slots=True)
class LinkAccount:
    """What the receiver has seen so far; written by its thread only, read by others at leisure."""

    sessions: list[SessionAccount] = field(default_factory=list)
    connects: int = 0
    garbage: int = 0
    no_clock: int = 0


class Receiver:
    """Owns the link and speaks the host's role over it.

    Args:
        link: open link; closed by this.
        host_id: random id of this process's life.
        queue: where frames go.
        listener: told of sessions and frames.
    """

    def __init__(self, link: Link, host_id: str, queue: PairQueue, listener: BoardListener) -> None:
        self._link = link
        self._queue = queue
        self._listener = listener
        self._session = HostSession(host_id, link.dialled)
        self._clock = ClockEstimator()
        self._hello: BoardHello | None = None
        self._transit_ns = _UNKNOWN_NS
        self._poller = zmq.Poller()
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        for pollable in (*link.pollables, self._wake_read):
            self._poller.register(pollable, zmq.POLLIN)
        self._stopping = False
        self._later_ns = 0
        self._settled = False
        self._thread = threading.Thread(target=self._run, name="receiver", daemon=True)
        self.account = LinkAccount()
        self.failure: Exception | None = None
        self._refused: tuple[RefusalReason, int] | None = None

    @property
    def refused(self) -> RefusalReason | None:
        """Why the board that was last heard does not talk to us; None when it does, or is silent now."""
        if self._refused is None or now.monotonic_ns() - self._refused[1] > _REFUSAL_NS:
            return None
        return self._refused[0]

    @property
    def connected(self) -> bool:
        """Whether a board talks to us now."""
        return self._session.is_open

    @property
    def hello(self) -> BoardHello | None:
        """What the board said of itself; None before the first contact."""
        return self._hello

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now."""
        return self._clock.estimate

    @property
    def ended(self) -> bool:
        """Whether the board's camera has come to its end."""
        return bool(self.account.sessions) and self.account.sessions[-1].ended

    def start(self) -> None:
        """Begin to look for the board."""
        self._thread.start()

    def wake(self) -> None:
        """Let the thread look at the queue's free places now; safe from any thread."""
        with suppress(BlockingIOError):  # then it has been told often enough
            os.write(self._wake_write, b"\0")

    def steer(self, later_ns: int) -> None:
        """Ask the board's camera to expose later; safe from any thread."""
        self._later_ns = later_ns
        self.wake()

    def stop(self) -> None:
        """Say goodbye and close the link."""
        self._stopping = True
        self.wake()
        self._thread.join()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._step()
            self._part()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error
        finally:
            self._link.close()

    def _part(self) -> None:
        """Say goodbye and wait a moment for the board's last account: it comes behind the last frame."""
        farewell = self._session.leave()
        self._handle(farewell, now.monotonic_ns())
        deadline_ns = now.monotonic_ns() + _FAREWELL_NS
        while farewell and not self._settled and (left_ns := deadline_ns - now.monotonic_ns()) > 0:
            self._poller.poll(left_ns // 1_000_000 + 1)
            for incoming in self._link.receive():
                self._take(incoming, now.monotonic_ns())

    def _step(self) -> None:
        now_ns = now.monotonic_ns()
        due_ns = min(self._session.due_ns, self._link.due_ns)
        wait_ms = min(_LONGEST_WAIT_MS, max(0, -((now_ns - due_ns) // 1_000_000)))
        ready = self._poller.poll(wait_ms)
        if ready or now.monotonic_ns() >= self._link.due_ns:
            for incoming in self._link.receive():
                self._take(incoming, now.monotonic_ns())
            if any(item == self._wake_read for item, _ in ready):
                os.read(self._wake_read, 4096)
        now_ns = now.monotonic_ns()
        if now_ns >= self._session.due_ns:
            self._handle(self._session.tick(now_ns), now_ns)
        self._queue.tick()
        self._grant(now_ns)
        if self._later_ns:
            later_ns, self._later_ns = self._later_ns, 0
            self._handle(self._session.steer(later_ns), now_ns)

    def _take(self, incoming: Incoming, now_ns: int) -> None:
        match incoming:
            case Broken():
                self._handle(self._session.interrupted(now_ns), now_ns)
            case Garbage():
                self._count_garbage("not a packet")
            case Packet(connection, header, payload):
                try:
                    message = decode(header, payload)
                except VersionError as error:
                    if not self._session.is_open:  # in a running session it is somebody else's noise
                        self._refused = (RefusalReason.VERSION, now_ns)
                    self._count_garbage(error.problem)
                except ProtocolError as error:
                    self._count_garbage(error.problem)
                else:
                    self._handle(self._session.receive(connection, message, now_ns), now_ns)

    def _count_garbage(self, problem: str) -> None:
        self.account.garbage += 1
        if self.account.garbage.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: a hostile peer must not fill the log
            _LOG.warning(event("garbage", count=self.account.garbage, problem=problem))

    def _grant(self, now_ns: int) -> None:
        estimate, hello = self._clock.estimate, self._hello
        if estimate is None or hello is None:
            return  # without a clock a frame could not be paired
        if hello.camera.pacing is Pacing.DEMAND or self._queue.held_back_by_credit:
            self._handle(self._session.grant(self._queue.free_slots()), now_ns)
            return
        # One frame under way, more only where the link is longer than a period: each further one would be older when used.
        # A link that itself holds the next frame back, so that a newer one may take its place, always has credit for that one too.
        periods = math.floor(estimate.round_trip_ns / hello.camera.period_ns)
        needed = min(_MOST_UNDER_WAY, 1 + max(periods, int(self._link.self_paced)))
        if self._session.outstanding < needed:
            # A swift link never has two frames under way, whatever the credit: then several are granted at once, which spares the
            # board most wake-ups (a fifth of its CPU time a frame, bench_link).
            swift = self._transit_ns * _SWIFT < hello.camera.period_ns
            self._handle(self._session.grant(_MOST_UNDER_WAY if swift else needed), now_ns)

    def _handle(self, outputs: list[Output], now_ns: int) -> None:
        for output in outputs:
            match output:
                case Outgoing(connection, message):
                    header, payload = encode_stamped(message, now.monotonic_ns)
                    self._link.send(connection, header, payload)
                case Arrived(frame, lost):
                    self._accept_frame(frame, lost, now_ns)
                case Echo():
                    self._clock.add(output)
                case Stale(_, old_session):
                    self._current.old_session += old_session
                    self._current.duplicate += not old_session
                case Accepted():
                    self._begin(output)
                case Counted(counts, ended, lost, last):
                    self._settled = last
                    self._current.lost += lost
                    self._current.latest = max(counts, self._current.latest, key=lambda account: account.grabbed)
                    self._current.ended |= ended
                case Refused(reason):
                    self._refused = (reason, now_ns)
                case Vanished(orderly):
                    self._current.vanished = not orderly
                    _LOG.info(event("board_gone", session=self._current.session, orderly=orderly))

    @property
    def _current(self) -> SessionAccount:
        if not self.account.sessions:
            self.account.sessions.append(SessionAccount("", BoardCounts(), BoardCounts()))
        return self.account.sessions[-1]

    def _begin(self, accepted: Accepted) -> None:
        hello = accepted.hello
        self._refused = None
        self.account.connects += 1
        if self._hello is None or self._hello.boot_id != hello.boot_id:
            self._clock = ClockEstimator()  # another boot is another clock
        self._hello = hello
        self._transit_ns = _UNKNOWN_NS
        if accepted.resumed:
            self._current.lost += accepted.lost
            self._current.vanished = False
        else:
            self.account.sessions.append(SessionAccount(hello.session, hello.counts, hello.counts))
            self._listener.session_began()
            self._queue.begin(hello.camera.period_ns, on_demand=hello.camera.pacing is Pacing.DEMAND)
        camera = hello.camera
        size = f"{camera.width_px}x{camera.height_px}"
        _LOG.info(event("board_found", session=hello.session, resumed=accepted.resumed, camera=camera.name, size=size))

    def _accept_frame(self, frame: FrameMessage, lost: int, now_ns: int) -> None:
        account = self._current
        account.received += 1
        account.lost += lost
        estimate = self._clock.estimate
        if estimate is None:
            self.account.no_clock += 1
            return
        # Only `sent` is mapped to the host's clock, once, here; the other marks keep their distance to it.
        sent_ns = frame.marks.sent_ns
        offset_ns = estimate.offset_at(sent_ns)
        marks = frame.marks.moved_to(sent_ns + offset_ns)
        uncertainty_ns = estimate.uncertainty_at(sent_ns)
        self._transit_ns = now_ns - marks.sent_ns
        self._queue.add_board(BoardFrame(frame, self._link.kind, marks, now_ns, offset_ns, uncertainty_ns))
        on_demand = self._hello is not None and self._hello.camera.pacing is Pacing.DEMAND
        self._listener.frame_arrived(marks.exposed_ns, frame.sequence if on_demand else None)


def refusal_text(reason: RefusalReason) -> tuple[str, str]:
    """What a refusal means, and its remedy."""
    match reason:
        case RefusalReason.BUSY:
            return "the board is busy with another host", "stop the other one first"
        case RefusalReason.VERSION:
            return "the board speaks another protocol version", "update the older of the two"
