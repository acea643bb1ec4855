"""The board's side of a session: serves one host at a time, sends a frame only against credit. Sans-I/O, `now_ns` passed in."""

from dataclasses import dataclass, field
from typing import assert_never

from common.frame import Frame
from common.ledger import BoardMarks
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    CameraDescription,
    Credit,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Status,
    Steer,
)
from common.protocol.session import HELLO_RETRY_NS, SILENCE_NS, STATUS_NS, TAKEOVER_NS, Outgoing

_NEVER = 2**63 - 1


@dataclass(slots=True)
class _Host:
    """The host that is served."""

    host_id: str
    heard_ns: int
    status_due_ns: int
    lanes: dict[Lane, bytes] = field(default_factory=dict)
    below_index: int = 0


class BoardSession:
    """One life of a board process as seen over one link.

    Args:
        session: random id of this process's life.
        boot_id: id of the machine's boot.
        camera: what the host must know of the camera.
        dialled: the connections that this side opened itself (`?connect=1`); empty when the host dials.
    """

    def __init__(
        self, session: str, boot_id: str, camera: CameraDescription, dialled: tuple[tuple[Lane, bytes], ...] = ()
    ) -> None:
        self.session = session
        self._boot_id = boot_id
        self._camera = camera
        self._dialled = dialled
        self._knock_due_ns = 0
        self._host: _Host | None = None
        self._sent = 0
        self._ended = False
        self._later_ns = 0

    @property
    def has_host(self) -> bool:
        """Whether a host is there that frames could be sent to."""
        return self._host is not None and Lane.FRAMES in self._host.lanes

    @property
    def has_credit(self) -> bool:
        """Whether the next frame may be sent now."""
        return self._host is not None and Lane.FRAMES in self._host.lanes and self._sent < self._host.below_index

    def receive(  # noqa: PLR0911 - one line for each kind of message
        self, connection: bytes, message: Message, now_ns: int, counts: BoardCounts
    ) -> list[Outgoing]:
        """Take one message from a connection.

        Args:
            connection: where it came from.
            message: what came.
            now_ns: its arrival on the board's clock, ns.
            counts: the account of this session's frames now.

        Returns:
            What to send.
        """
        if isinstance(message, HostHello):
            return self._greet(connection, message, now_ns, counts)
        host = self._host
        if host is None or connection not in host.lanes.values():
            # Somebody from before a restart, or a stranger: a clock echo shows which lane it is.
            return [] if isinstance(message, Bye) else [Outgoing(connection, Knock(Lane.CONTROL, self.session))]
        host.heard_ns = now_ns
        match message:
            case Ping(wave, t0_ns):
                return [Outgoing(connection, Pong(wave, t0_ns, now_ns, now_ns))]
            case Credit(below_index):
                host.below_index = max(host.below_index, below_index)
                return []
            case Steer(later_ns):
                self._later_ns = later_ns % self._camera.period_ns
                return []
            case Bye():
                # The last account goes behind the last frame, so that what it tells of and has not come is lost.
                farewell = Status(self.session, counts)
                self._host = None
                return [Outgoing(host.lanes[Lane.FRAMES], farewell)] if Lane.FRAMES in host.lanes else []
            case BoardHello() | Knock() | Refusal() | FrameMessage() | Pong() | Status() | End():
                return []  # a board's words from a host: nothing a sound host sends
            case _:
                assert_never(message)

    def take_steering(self) -> int:
        """Give by how much the host wants the camera to expose later, ns, once; 0: it wants nothing."""
        later_ns, self._later_ns = self._later_ns, 0
        return later_ns

    def tick(self, now_ns: int, counts: BoardCounts) -> list[Outgoing]:
        """Do what time demands: account to the host, give up a silent one, knock where this side has dialled."""
        outgoing: list[Outgoing] = []
        host = self._host
        if host is not None and now_ns - host.heard_ns >= SILENCE_NS:
            self._host = host = None
        if host is not None and now_ns >= host.status_due_ns:
            host.status_due_ns = now_ns + STATUS_NS
            outgoing += self._account(host, counts)
        if self._dialled and now_ns >= self._knock_due_ns:
            known = {} if host is None else host.lanes
            outgoing += [
                Outgoing(connection, Knock(lane, self.session))
                for lane, connection in self._dialled
                if lane not in known
            ]
            self._knock_due_ns = now_ns + HELLO_RETRY_NS
        return outgoing

    @property
    def due_ns(self) -> int:
        """When `tick` wants to be called next, board's clock, ns."""
        due = self._knock_due_ns if self._dialled else _NEVER
        if self._host is not None:
            due = min(due, self._host.heard_ns + SILENCE_NS, self._host.status_due_ns)
        return due

    def send(self, frame: Frame) -> Outgoing:
        """Put a frame into words; its `sent` mark is set when the shell stamps it, the credit is spent by `sent`.

        Args:
            frame: a sound frame; only to be called while `has_credit`.
        """
        assert self._host is not None
        marks = BoardMarks(frame.exposed.ns, frame.grabbed.ns, frame.grabbed.ns)
        size = (frame.width_px, frame.height_px, frame.pixel_format)
        message = FrameMessage(self.session, self._sent, frame.sequence, *size, frame.exposure_ns, marks, frame.payload)
        return Outgoing(self._host.lanes[Lane.FRAMES], message)

    def sent(self) -> None:
        """Take note that the link took the frame."""
        self._sent += 1

    def unreachable(self, connection: bytes) -> list[Outgoing]:
        """Take note that a connection is gone; a host that is still heard on the other one is asked to say hello anew."""
        if self._host is None or connection not in self._host.lanes.values():
            return []  # a stranger's end is nothing to the host
        self._host.lanes = {lane: known for lane, known in self._host.lanes.items() if known != connection}
        return [
            Outgoing(known, Knock(lane, self.session))
            for lane, known in self._host.lanes.items()
            if lane is Lane.CONTROL
        ]

    def end(self, counts: BoardCounts) -> list[Outgoing]:
        """Tell the host, behind the last frame, that none will follow; from now on `tick` repeats it."""
        self._ended = True
        return (
            [Outgoing(self._host.lanes[Lane.FRAMES], End(self.session, counts))]
            if self._host is not None and self.has_host
            else []
        )

    def leave(self, counts: BoardCounts) -> list[Outgoing]:
        """Say goodbye to the host, with the final account; behind the last frame where its lane is there."""
        lanes = {} if self._host is None else self._host.lanes
        connection = lanes.get(Lane.FRAMES, lanes.get(Lane.CONTROL))
        return [] if connection is None else [Outgoing(connection, Bye(counts))]

    def _account(self, host: _Host, counts: BoardCounts) -> list[Outgoing]:
        """Give the account of the frames, and mend what a lost packet could have left for ever.

        A frame that is lost without a sound takes its credit with it: behind the last frame on its own lane the account tells so. A knock
        that is lost leaves a host without its frames' lane.
        """
        outgoing: list[Outgoing] = []
        if Lane.CONTROL in host.lanes:
            outgoing.append(Outgoing(host.lanes[Lane.CONTROL], Status(self.session, counts)))
            if Lane.FRAMES not in host.lanes:
                outgoing.append(Outgoing(host.lanes[Lane.CONTROL], Knock(Lane.CONTROL, self.session)))
        if self._ended:
            outgoing += self.end(counts)
        elif self.has_host and not self.has_credit:
            outgoing.append(Outgoing(host.lanes[Lane.FRAMES], Status(self.session, counts)))
        return outgoing

    def _greet(self, connection: bytes, hello: HostHello, now_ns: int, counts: BoardCounts) -> list[Outgoing]:
        host = self._host
        if host is not None and host.host_id != hello.host_id and now_ns - host.heard_ns < TAKEOVER_NS:
            return [Outgoing(connection, Refusal(RefusalReason.BUSY))]
        if host is None or host.host_id != hello.host_id:
            self._host = host = _Host(hello.host_id, now_ns, now_ns + STATUS_NS)
        host.heard_ns = now_ns
        if hello.lane is Lane.FRAMES:
            host.below_index = self._sent  # credit of an earlier connection is void
        host.lanes[hello.lane] = connection
        return [Outgoing(connection, BoardHello(self.session, self._boot_id, self._camera, counts))]
