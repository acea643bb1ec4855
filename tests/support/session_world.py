"""A board and hosts wired together in memory, on simulated time, over connections that may lose, repeat and break.

Each lane is a connection with a queue for each direction: order holds within a queue, never between two. A connection that breaks takes
what was under way with it; the side that had dialled gets word of it and a fresh connection. The world itself checks what must always hold.
"""

from collections import deque
from dataclasses import dataclass, field

from common.frame import Frame, PixelFormat
from common.protocol.board_session import BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    CameraDescription,
    Credit,
    FrameMessage,
    HostHello,
    Lane,
    Message,
    Pacing,
)
from common.protocol.session import MS, Accepted, Arrived, Counted, Echo, Outgoing, Output, Refused, Stale, Vanished
from common.stamp import Stamp

CAMERA = CameraDescription("simulated", 640, 480, PixelFormat.MJPEG, 33 * MS, Pacing.CLOCK)
STEP_NS = 20 * MS


class Broken:
    """Word to the side that had dialled: the connection broke."""


@dataclass(slots=True)
class Wire:
    """One life of a lane's connection."""

    to_board: "deque[Message | Broken]" = field(default_factory=deque)
    to_host: "deque[Message | Broken]" = field(default_factory=deque)


@dataclass(slots=True)
class HostNode:
    """A host with its account of what it was told."""

    number: int
    session: HostSession
    wires: dict[Lane, Wire] = field(default_factory=dict)
    names: dict[Lane, bytes] = field(default_factory=dict)
    board_session: str = ""
    base_sent: int = 0
    received: int = 0
    lost: int = 0
    arrived: list[tuple[str, int]] = field(default_factory=list)
    stale: list[Stale] = field(default_factory=list)
    others: list[Output] = field(default_factory=list)
    slots: int = 1


class World:
    """One board, its hosts, and the time.

    Args:
        board_dials: whether the board opens the connections (then there is one host).
    """

    def __init__(self, *, board_dials: bool = False) -> None:
        self.now_ns = 10**12
        self.board_dials = board_dials
        self.lives = 0
        self.sent: dict[str, int] = {}
        self.credit: dict[str, int] = {}
        self.camera_runs = True
        self.wires: dict[bytes, tuple[HostNode, Lane, Wire]] = {}
        self.hosts: list[HostNode] = []
        self.board = self._new_board()
        self.add_host()

    # What may happen.

    def add_host(self) -> HostNode:
        """One more host comes."""
        self.hosts.append(HostNode(len(self.hosts), HostSession("", {})))
        return self.restart_host(self.hosts[-1])

    def restart_board(self) -> None:
        """The board's process dies and a new life begins."""
        self.board = self._new_board()
        for host in self.hosts:
            for lane in Lane:
                self.break_lane(host, lane)

    def restart_host(self, host: HostNode) -> HostNode:
        """A host's process dies without a word and a new one begins."""
        self.lives += 1
        dialled = {} if self.board_dials else {lane: lane.name.encode() for lane in Lane}
        fresh = HostNode(host.number, HostSession(f"host-{self.lives}", dialled), host.wires)
        self.hosts[self.hosts.index(host)] = fresh
        for lane in Lane:
            self.break_lane(fresh, lane, tell=self.board_dials)
        return fresh

    def break_lane(self, host: HostNode, lane: Lane, *, tell: bool = True) -> None:
        """A connection breaks: what was under way is gone, the dialler gets word and a new connection."""
        self.lives += 1
        name = f"{host.number}-{lane.name}-{self.lives}".encode()
        wire = Wire()
        self.wires = {known: held for known, held in self.wires.items() if held[2] is not host.wires.get(lane)}
        host.wires[lane] = wire
        if self.board_dials:
            host.names[lane] = name
            self.wires[lane.name.encode()] = self.wires[name] = (host, lane, wire)
            queue = wire.to_board
        else:
            host.names[lane] = lane.name.encode()
            self.wires[name] = (host, lane, wire)
            queue = wire.to_host
        if tell:
            queue.append(Broken())

    def deliver(self, host: HostNode, lane: Lane, *, to_board: bool, keep: bool = False) -> bool:
        """Let one message arrive; `keep` leaves a second copy of it under way."""
        queue = host.wires[lane].to_board if to_board else host.wires[lane].to_host
        if not queue:
            return False
        message = queue[0] if keep and not isinstance(queue[0], Broken) else queue.popleft()
        if to_board:
            self._board_takes(host, lane, message)
        else:
            self._host_takes(host, lane, message)
        return True

    def drop(self, host: HostNode, lane: Lane, *, to_board: bool) -> None:
        """Lose one message without a sound."""
        queue = host.wires[lane].to_board if to_board else host.wires[lane].to_host
        if queue and not isinstance(queue[0], Broken):
            queue.popleft()

    def inject(self, host: HostNode, frame: FrameMessage) -> None:
        """A transport delivers a frame that it had delivered before."""
        self._host_takes(host, Lane.FRAMES, frame)

    def pass_time(self, duration_ns: int) -> None:
        """Let time pass; both sides do what it demands, the board sends what it may, hosts grant what they like."""
        self.now_ns += duration_ns
        self.shoot()
        if self.now_ns >= self.board.due_ns:
            self._board_says(self.board.tick(self.now_ns, self.counts))
            assert self.board.due_ns > self.now_ns, "a tick must move its own time on, or the poll loop would spin"
        for host in self.hosts:
            if self.now_ns >= host.session.due_ns:
                self._host_does(host, host.session.tick(self.now_ns))
                assert host.session.due_ns > self.now_ns
            self._host_does(host, host.session.grant(host.slots))

    def shoot(self) -> None:
        """The camera has a frame; it is sent if there is credit."""
        if self.camera_runs and self.board.has_credit:
            stamp = Stamp(self.now_ns, "board")
            index = self.sent[self.board.session]
            frame = Frame(index, stamp, stamp, 640, 480, PixelFormat.MJPEG, None, b"")
            if self._board_sends(self.board.send(frame)):
                self.board.sent()
                self.sent[self.board.session] += 1

    def settle(self, duration_ns: int = 2000 * MS) -> None:
        """Everything arrives, at once and in order, while time passes."""
        for _ in range(duration_ns // STEP_NS):
            self.pass_time(STEP_NS)
            self.deliver_all()

    def deliver_all(self) -> None:
        """Let everything under way arrive, and the answers to it."""
        for _ in range(2000):
            moved = [
                self.deliver(host, lane, to_board=to_board)
                for host in self.hosts
                for lane in Lane
                for to_board in (True, False)
            ]
            if not any(moved):
                return
        raise AssertionError("the two never stop talking")

    @property
    def counts(self) -> BoardCounts:
        """The board's account."""
        sent = self.sent[self.board.session]
        return BoardCounts(sent, sent)

    # How the shells of both sides behave.

    def _new_board(self) -> BoardSession:
        self.lives += 1
        session = f"board-{self.lives}"
        self.sent[session] = 0
        dialled = tuple((lane, lane.name.encode()) for lane in Lane) if self.board_dials else ()
        return BoardSession(session, "boot", CAMERA, dialled)

    def _board_name(self, host: HostNode, lane: Lane) -> bytes:
        if self.board_dials:
            return lane.name.encode()
        return next(name for name, (_, _, wire) in self.wires.items() if wire is host.wires[lane])

    def _board_takes(self, host: HostNode, lane: Lane, message: Message | Broken) -> None:
        name = self._board_name(host, lane)
        if isinstance(message, Broken):
            self._board_says(self.board.unreachable(name))
        else:
            self._board_says(self.board.receive(name, message, self.now_ns, self.counts))

    def _board_says(self, said: list[Outgoing]) -> None:
        for outgoing in said:
            self._board_sends(outgoing)

    def _board_sends(self, outgoing: Outgoing) -> bool:
        found = self.wires.get(outgoing.connection)
        if found is None:
            self._board_says(self.board.unreachable(outgoing.connection))
            return False
        _, lane, wire = found
        if isinstance(outgoing.message, FrameMessage):
            assert lane is Lane.FRAMES
            frame = outgoing.message
            assert frame.sent_index < self.credit.get(frame.session, 0), "a frame was sent without credit"
        wire.to_host.append(outgoing.message)
        return True

    def _host_takes(self, host: HostNode, lane: Lane, message: Message | Broken) -> None:
        if isinstance(message, Broken):
            self._host_does(host, host.session.interrupted(self.now_ns))
        else:
            self._host_does(host, host.session.receive(host.names[lane], message, self.now_ns))

    def _host_does(self, host: HostNode, outputs: list[Output]) -> None:
        for output in outputs:
            match output:
                case Outgoing(connection, message):
                    self._host_sends(host, connection, message)
                case Accepted(hello, resumed, lost):
                    assert lost >= 0
                    assert resumed == (host.board_session == hello.session)
                    if not resumed:
                        host.board_session, host.base_sent = hello.session, hello.counts.sent
                        host.received = host.lost = 0
                    host.lost += lost
                case Arrived(frame, lost):
                    assert lost >= 0
                    assert frame.session == host.board_session, "a frame of an old session was taken"
                    assert (frame.session, frame.sent_index) not in host.arrived, "a frame was taken twice"
                    host.arrived.append((frame.session, frame.sent_index))
                    host.received += 1
                    host.lost += lost
                case Stale():
                    host.stale.append(output)
                case Counted(_, _, lost):
                    assert lost >= 0
                    host.lost += lost
                case Echo() | Refused() | Vanished():
                    host.others.append(output)

    def _host_sends(self, host: HostNode, connection: bytes, message: Message) -> None:
        if isinstance(message, Credit):
            known = self.credit.get(host.board_session, 0)
            self.credit[host.board_session] = max(known, message.below_index)
        for lane, name in host.names.items():
            if name == connection:
                assert not isinstance(message, HostHello) or message.lane is lane
                host.wires[lane].to_board.append(message)
