"""The board's composition root: camera -> outbox -> session -> links, in one poll loop."""

import logging
import socket
from collections.abc import Sequence
from typing import Final

from board_agent.camera_watch import CameraWatch
from board_agent.outbox import Outbox
from board_agent.rate_control import RateControl
from board_agent.sd_notify import Notifier
from board_agent.status import StatusLine
from common import now
from common.camera.base import Camera, CameraHealth, CameraState, Ended, Skipped, Spoiled, held_locks, lockable
from common.errors import ProtocolError
from common.frame import Frame
from common.link.base import Broken, Garbage, Link, Packet, SendResult, SeveralLinks
from common.link.waiter import Waiter
from common.program.logs import event
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    Credit,
    DropReason,
    Locks,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
)
from common.protocol.terms import Outgoing
from common.protocol.wire import VersionError, decode, encode, encode_for_any_version, encode_frame, encode_stamped
from common.value import value
from common.versions import other_protocol

_LOG = logging.getLogger(__name__)

_DRAIN_NS: Final = 5_000_000_000
"""After the last frame the host gets this long to say goodbye. No pipeline keeps a pair longer."""

_FAREWELL_NS: Final = 300_000_000
"""A host answers a goodbye within a round trip. If it hangs, the wait is too short for a person to notice."""

_FULL_RETRY_NS: Final = 2_000_000
"""If a link is full, a frame that must not be dropped is offered again after this time. ZeroMQ does not say when it has room."""

_AHEAD_NS: Final = 40_000_000
"""After a frame the board is awake anyway, so an account that is due before the next one goes now: each wake-up costs as much as the account."""

_LONGEST_WAIT_MS: Final = 1000
_NEVER_NS: Final = 2**63 - 1


@value(kw_only=True)
class Summary:
    """One life of the agent.

    Attributes:
        session: its id.
        counts: what became of its frames.
        garbage: packets that were not ours.
        ended: whether the camera reached its end (a replay without loop).
        camera: the camera's health.
    """

    session: str
    counts: BoardCounts
    garbage: int
    ended: bool
    camera: CameraHealth


@value()
class Service:
    """Tells the service manager that the loop is running, and how the board is doing.

    Attributes:
        notifier: sends it.
        status: makes the status line.
    """

    notifier: Notifier
    status: StatusLine

    def alive(
        self, now_ns: int, counts: BoardCounts, session: BoardSession, rung: Rung | None, camera: CameraState
    ) -> None:
        """Report that the loop is running, if a report is due."""
        text = self.status.text(
            now_ns, counts, has_host=session.has_host, carrier=session.carrier, rung=rung, camera=camera
        )
        self.notifier.alive(now_ns, text)


class Agent:
    """Serves a camera's frames over links until stopped.

    Args:
        camera: open camera.
        links: open links; one host at a time over all of them.
        session: random id of this process's life.
        boot_id: id of the machine's boot.
        wake: readable end of a socket that signals write to.
        service: is told that the loop is running; None outside a service.
        idle_ns: the camera rests after this time without a host; None: never.
        control: chooses a camera mode that the link can carry; None: the camera stays as it is.
    """

    def __init__(
        self,
        camera: Camera,
        links: Sequence[Link],
        session: str,
        boot_id: str,
        wake: socket.socket,
        *,
        service: Service | None = None,
        idle_ns: int | None = None,
        control: RateControl | None = None,
    ) -> None:
        self._control = control
        self._service = service
        self._idle_ns = idle_ns
        self._alone_since_ns = now.monotonic_ns()
        self._sleep = now.SleepWatch()
        self._camera = camera
        self._links = links
        self._several = SeveralLinks(links)
        self._wake_fd = wake.fileno()
        self._on_demand = camera.description.pacing is Pacing.DEMAND
        self._outbox = Outbox()
        dialled = tuple(
            (lane, _address(i, path)) for i, link in enumerate(links) for lane, path in link.dialled.items()
        )
        self._session = BoardSession(session, boot_id, camera.description, dialled)
        if control is not None:
            self._session.describe(camera.description, control.rung)
        self._held: Locks = ()
        self._had_host = False
        self._camera_ended = False
        self._held_back = False
        self._retry_ns = 0
        self._heard = False
        self._garbage = 0
        self._refused = 0
        self._stopping = False
        self._waiter = Waiter([wake, *(item for link in links for item in link.pollables)])
        self._camera_watch = CameraWatch(camera, self._waiter)

    def run(self) -> Summary:
        """Serve until a signal comes or the camera ends; then say goodbye.

        Raises:
            DataError: the camera's images have become unreadable.
        """
        now_ns = now.monotonic_ns()
        while not self._stopping and not (self._camera_ended and self._outbox.waiting is None):
            session_due_ns = self._session.due_ns
            camera_due_ns = self._demand_due_ns(now_ns) if self._on_demand else self._camera.due_ns(now_ns)
            camera_ready = self._poll(min(session_due_ns, camera_due_ns), now_ns)
            now_ns = now.monotonic_ns()
            if camera_ready or self._on_demand or now_ns >= camera_due_ns:
                self._grab(now_ns)
            if self._outbox.waiting is not None:
                if slept_ns := self._sleep.slept_ns():
                    self._note_sleep(slept_ns)
                if self._flush():
                    session_due_ns -= _AHEAD_NS
            if self._control is not None and self._control.is_due(now_ns):
                self._adapt(self._control, now_ns)
            if self._heard or now_ns >= session_due_ns or not self._had_host:
                self._attend(now_ns)
            if self._service is not None and self._service.notifier.due(now_ns):
                rung = None if self._control is None else self._control.rung
                self._service.alive(now_ns, self._outbox.counts, self._session, rung, self._camera.health.state)
        if self._camera_ended and not self._stopping:
            self._drain()
        self._outbox.discard(DropReason.STOPPED)
        self._part()
        return Summary(
            session=self._session.session,
            counts=self._outbox.counts,
            garbage=self._garbage,
            ended=self._camera_ended,
            camera=self._camera.health,
        )

    def _attend(self, now_ns: int) -> None:
        """Do what the host's last words ask for, and what the session has to do by the next frame."""
        self._heard = False
        if later_ns := self._session.take_steering():
            self._camera.steer(later_ns, now_ns)
        if locks := self._session.take_locks():
            self._hold(locks, now_ns)
        self._watch_locks()
        self._send_all(self._session.tick(now_ns, self._outbox.counts, _AHEAD_NS))
        self._watch_host(now_ns)

    def _hold(self, locks: Locks, now_ns: int) -> None:
        """Hold the camera's controls as the host asks, and tell it what became of that."""
        if (holder := lockable(self._camera)) is not None:
            holder.hold(locks, now_ns)
        self._held = held_locks(self._camera)
        self._session.hold(self._held)

    def _watch_locks(self) -> None:
        """Tell the host when other controls are held than before: the camera has settled, or came back."""
        if (held := held_locks(self._camera)) != self._held:
            self._held = held
            self._session.hold(held)

    def _demand_due_ns(self, now_ns: int) -> int:
        """When a camera that shows images on demand is to be read next."""
        return max(now_ns, self._retry_ns) if self._session.has_credit and not self._held_back else _NEVER_NS

    def _poll(self, due_ns: int, now_ns: int) -> bool:
        """Wait for whatever comes first and receive all packets. The wait is rounded up, because waking early would only spin.

        Returns:
            Whether the camera's descriptor is readable.
        """
        camera_fd = self._camera_watch.look()
        links_due_ns = _NEVER_NS
        for link in self._links:
            links_due_ns = min(links_due_ns, link.due_ns)
        wait_ns = min(due_ns, links_due_ns) - now_ns
        ready = self._waiter.wait(min(_LONGEST_WAIT_MS, -(-wait_ns // 1_000_000)) if wait_ns > 0 else 0)
        if self._wake_fd in ready:
            self._stopping = True
        if (ready and ready != [camera_fd]) or now.monotonic_ns() >= links_due_ns:
            self._receive()
        return camera_fd in ready

    def _receive(self) -> None:
        """Receive all packets."""
        for index, incoming in self._several.receive():
            self._take(index, incoming)

    def _take(self, index: int, incoming: Packet | Broken | Garbage) -> None:
        arrived_ns = now.monotonic_ns()
        connection = _address(index, incoming.connection)
        match incoming:
            case Packet(_, header, payload):
                try:
                    message = decode(header, payload)
                except VersionError as error:
                    self._refuse_version(index, incoming.connection, error.theirs)
                except ProtocolError as error:
                    self._refuse_garbage(connection, error.problem)
                else:
                    # Credit and questions for the time come all the time and make nothing due.
                    self._heard |= not isinstance(message, Credit | Ping)
                    self._send_all(self._session.receive(connection, message, arrived_ns, self._outbox.counts))
            case Broken():
                self._heard = True
                self._send_all(self._session.unreachable(connection))
            case Garbage():
                self._refuse_garbage(connection, "not a packet")

    def _refuse_version(self, index: int, connection: bytes, theirs: int) -> None:
        """Refuse a host of another version, in two envelopes: ours, which tells it our version, and its own, which it can read."""
        self._refused += 1
        if self._refused.bit_count() == 1:  # as for garbage: an old host asks five times a second
            problem, remedy = other_protocol(theirs, peer="the host", own="this board")
            _LOG.warning(event("host_refused", reason="version", problem=problem, remedy=remedy, count=self._refused))
        refusal = Refusal(RefusalReason.VERSION)
        for header in (encode(refusal)[0], encode_for_any_version(theirs, refusal)):
            self._links[index].send(connection, header, b"")

    def _refuse_garbage(self, connection: bytes, problem: str) -> None:
        self._garbage += 1
        if self._garbage.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: a hostile peer must not fill the log
            _LOG.warning(event("garbage", connection=connection.hex(), count=self._garbage, problem=problem))

    def _grab(self, now_ns: int) -> None:
        if self._on_demand and not (self._session.has_credit and self._outbox.waiting is None):
            return
        for grab in self._camera.read(now_ns):
            match grab:
                case Frame():
                    self._outbox.put(grab, has_host=self._session.has_host)
                case Spoiled(sequence, fault):
                    self._outbox.spoiled()
                    _LOG.debug(event("frame_spoiled", sequence=sequence, fault=fault.value))
                case Skipped(_, frames):
                    self._outbox.skipped(frames)
                case Ended():
                    self._camera_ended = True

    def _note_sleep(self, slept_ns: int) -> None:
        """Handle that the machine has slept. Drop a frame from before: the clock stood still between its exposure and its sending."""
        self._outbox.discard(DropReason.NO_HOST)
        self._session.begin_clock(now.random_id())
        _LOG.info(event("slept", session=self._session.session, seconds=round(slept_ns / 1e9, 1)))

    def _flush(self) -> bool:
        """Send the waiting frame if there is credit for it. If it reaches nobody, it waits until the host returns or a newer frame replaces it.

        Returns:
            Whether it was sent.
        """
        frame, lane = self._outbox.waiting, self._session.frames_lane
        self._held_back = False
        if frame is None or lane is None:
            return False
        link, connection = self._links[lane[0]], lane[1:]
        if link.self_paced and not link.ready(connection):
            self._held_back = True  # the previous frame is still leaving; this one waits, or a newer one
            return False
        session = self._session
        header = encode_frame(session.session, session.next_index, frame, now.monotonic_ns)
        match link.send(connection, header, frame.payload):
            case SendResult.SENT:
                session.sent(now.monotonic_ns())
                self._outbox.sent()
                return True
            case SendResult.UNREACHABLE:
                self._send_all(session.unreachable(lane))
            case SendResult.FULL if not self._on_demand:
                self._outbox.discard(DropReason.LINK_FULL)
            case SendResult.FULL:
                self._retry_ns = now.monotonic_ns() + _FULL_RETRY_NS
        return False

    def _adapt(self, control: RateControl, now_ns: int) -> None:
        """Set the camera to what the link carries."""
        if not control.update(self._outbox.counts, self._session.carrier, now_ns):
            return
        self._camera.adapt(control.mode, now_ns)
        rung = control.rung
        self._session.describe(self._camera.description, rung)
        fps = round(1e9 / rung.period_ns, 2)
        size = f"{rung.width_px}x{rung.height_px}"
        _LOG.info(event("camera_stepped", rung=rung.index, last=rung.last, fps=fps, quality=rung.quality, size=size))

    def _send_all(self, outgoing: list[Outgoing]) -> None:
        for item in outgoing:
            self._send(item)

    def _send(self, outgoing: Outgoing) -> SendResult:
        link = self._links[outgoing.connection[0]]
        result = link.send(outgoing.connection[1:], *encode_stamped(outgoing.message, now.monotonic_ns))
        if result is SendResult.UNREACHABLE:
            self._send_all(self._session.unreachable(outgoing.connection))
        if isinstance(outgoing.message, Pong):
            self._waiter.stay_awake()
        return result

    def _watch_host(self, now_ns: int) -> None:
        """Watch the host come and go. The camera rests when none has been there for a while."""
        if self._session.has_host != self._had_host:
            self._had_host = self._session.has_host
            self._alone_since_ns = now_ns
            _LOG.info(event("host_connected" if self._had_host else "host_gone", session=self._session.session))
            if self._session.cannot_turn:
                turn = self._camera.description.orientation
                remedy = "update the host's tandemscan, or leave rotate= and flip= out"
                _LOG.warning(event("host_cannot_turn", orientation=turn, remedy=remedy))
            if self._had_host:
                self._camera.resume(now_ns)
        elif not self._had_host and self._idle_ns is not None and now_ns - self._alone_since_ns >= self._idle_ns:
            self._camera.pause()

    def _drain(self) -> None:
        """Tell the host that there are no more frames, and give it time to process them."""
        _LOG.info(event("camera_ended", session=self._session.session))
        deadline_ns = now.monotonic_ns() + _DRAIN_NS
        unsaid = self._session.end(self._outbox.counts)
        while not self._stopping and self._session.has_host and (now_ns := now.monotonic_ns()) < deadline_ns:
            unsaid = [item for item in unsaid if self._send(item) is not SendResult.SENT]
            self._send_all(self._session.tick(now_ns, self._outbox.counts))
            self._poll(min(self._session.due_ns, deadline_ns), now_ns)

    def _part(self) -> None:
        """Say goodbye and stay until the host has answered: ZeroMQ discards unread data when a connection closes."""
        farewell = self._session.leave(self._outbox.counts)
        self._send_all(farewell)
        waiter = Waiter([item for link in self._links for item in link.pollables])
        deadline_ns = now.monotonic_ns() + _FAREWELL_NS
        while farewell and self._session.has_host and (left_ns := deadline_ns - now.monotonic_ns()) > 0:
            waiter.wait(left_ns // 1_000_000 + 1)
            self._receive()


def _address(link_index: int, connection: bytes) -> bytes:
    """Make a connection's name unique across all links."""
    return bytes((link_index,)) + connection
