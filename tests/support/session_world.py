"""A board and hosts wired together in memory, in simulated time, over connections that may lose and repeat messages, and break.

Each lane of each link is a connection with a queue for each direction: order holds within a queue, never between two. A
connection that breaks loses its messages under way; the side that dialled is notified and gets a fresh connection. The
world itself checks the invariants.
"""

from collections import deque
from dataclasses import dataclass, field, replace

from common.protocol.board_session import BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    Credit,
    FrameMessage,
    HostHello,
    Lane,
    Message,
)
from common.protocol.session import (
    MS,
    Accepted,
    Arrived,
    ClockVoid,
    Counted,
    Echo,
    LinkDown,
    LinkUp,
    OtherBoard,
    Outgoing,
    Output,
    Refused,
    Stale,
    Stepped,
    Unbelievable,
    Vanished,
    connection_name,
)
from tests.support.samples import CAMERA, FRAME, shot
from tests.support.sent_frames import frame_outgoing

STEP_NS = 20 * MS

Place = tuple[int, Lane]
"""A lane of a link, by the link's number."""


class Broken:
    """Notice to the side that dialled: the connection broke."""


@dataclass(slots=True)
class Wire:
    """One lane's connection, until it breaks."""

    to_board: "deque[Message | Broken]" = field(default_factory=deque)
    to_host: "deque[Message | Broken]" = field(default_factory=deque)


@dataclass(slots=True)
class HostNode:
    """A host with a record of what it was told."""

    number: int
    session: HostSession
    wires: dict[Place, Wire] = field(default_factory=dict)
    names: dict[Place, bytes] = field(default_factory=dict)
    board_session: str = ""
    boot_id: str = ""
    accepted_boot_id: str = ""
    base_sent: int = 0
    received: int = 0
    lost: int = 0
    arrived: list[tuple[str, int]] = field(default_factory=list)
    carriers: list[int] = field(default_factory=list)
    stale: list[Stale] = field(default_factory=list)
    others: list[Output] = field(default_factory=list)
    slots: int = 1


class World:
    """One board, its hosts, and the time.

    Args:
        board_dials: whether the board opens the connections (then there is one host).
        links: how many lead from the board to each host.
    """

    def __init__(self, *, board_dials: bool = False, links: int = 1) -> None:
        self.now_ns = 10**12
        self.places = tuple((link, lane) for link in range(links) for lane in Lane)
        self.cut: set[Place] = set()
        self.board_dials = board_dials
        self.lives = 0
        self.sent: dict[str, int] = {}
        self.credit: dict[str, int] = {}
        self.boot_id = "boot"
        self.clocks: dict[tuple[str, int], str] = {}
        self.camera_runs = True
        self.wires: dict[bytes, tuple[HostNode, Place, Wire]] = {}
        self.hosts: list[HostNode] = []
        self.board = self._new_board()
        self.add_host()

    # Events.

    def add_host(self) -> HostNode:
        """Add one more host."""
        self.hosts.append(HostNode(len(self.hosts), HostSession("", [{}])))
        return self.restart_host(self.hosts[-1])

    def restart_board(self) -> None:
        """The board's process dies and a new session begins."""
        self.board = self._new_board()
        for host in self.hosts:
            for place in self.places:
                self.break_lane(host, place)

    def sleep_board(self) -> None:
        """The board's machine is suspended and wakes up: its clock stood still."""
        self.lives += 1
        self.boot_id = f"boot-{self.lives}"
        self.board.begin_clock(self.boot_id)

    def restart_host(self, host: HostNode) -> HostNode:
        """A host's process dies without notice and a new one starts."""
        self.lives += 1
        numbers = sorted({link for link, _ in self.places})
        dialled: list[dict[Lane, bytes]] = [
            {} if self.board_dials else {lane: _dialled((link, lane)) for lane in Lane} for link in numbers
        ]
        fresh = HostNode(host.number, HostSession(f"host-{self.lives}", dialled), host.wires)
        self.hosts[self.hosts.index(host)] = fresh
        for place in self.places:
            self.break_lane(fresh, place, tell=self.board_dials)
        return fresh

    def break_lane(self, host: HostNode, place: Place, *, tell: bool = True) -> None:
        """A connection breaks: messages under way are lost; the dialler is notified and gets a new connection."""
        self.lives += 1
        link, lane = place
        name = connection_name(link, f"{host.number}-{lane.name}-{self.lives}".encode())
        wire = Wire()
        self.wires = {known: held for known, held in self.wires.items() if held[2] is not host.wires.get(place)}
        host.wires[place] = wire
        if self.board_dials:
            host.names[place] = name
            self.wires[_dialled(place)] = self.wires[name] = (host, place, wire)
            queue = wire.to_board
        else:
            host.names[place] = _dialled(place)
            self.wires[name] = (host, place, wire)
            queue = wire.to_host
        if tell:
            queue.append(Broken())

    def cut_link(self, link: int) -> None:
        """Nothing arrives over this link any more, and nobody is notified."""
        self.cut |= {(link, lane) for lane in Lane}

    def mend_link(self, link: int) -> None:
        """The link works again; messages under way are lost."""
        for lane in Lane:
            self.cut.discard((link, lane))

    def deliver(self, host: HostNode, place: Place, *, to_board: bool, keep: bool = False) -> bool:
        """Deliver one message; `keep` leaves a second copy of it under way."""
        queue = host.wires[place].to_board if to_board else host.wires[place].to_host
        if place in self.cut:
            news = [item for item in queue if isinstance(item, Broken)]  # each side is notified of its own end
            queue.clear()
            queue.extend(news)
        if not queue:
            return False
        message = queue[0] if keep and not isinstance(queue[0], Broken) else queue.popleft()
        if to_board:
            self._board_takes(host, place, message)
        else:
            self._host_takes(host, place, message)
        return True

    def drop(self, host: HostNode, place: Place, *, to_board: bool) -> None:
        """Lose one message silently."""
        queue = host.wires[place].to_board if to_board else host.wires[place].to_host
        if queue and not isinstance(queue[0], Broken):
            queue.popleft()

    def inject(self, host: HostNode, frame: FrameMessage) -> None:
        """A transport delivers a frame a second time."""
        self._host_takes(host, (0, Lane.FRAMES), frame)

    def pass_time(self, duration_ns: int) -> None:
        """Let time pass: both sides do what is due, the board sends what it may, hosts grant credit as they like."""
        self.now_ns += duration_ns
        self.shoot()
        if self.now_ns >= self.board.due_ns:
            self.board_says(self.board.tick(self.now_ns, self.counts))
            assert self.board.due_ns > self.now_ns, "a tick must move its own time on, or the poll loop would spin"
        for host in self.hosts:
            if self.now_ns >= host.session.due_ns:
                self.host_does(host, host.session.tick(self.now_ns))
                assert host.session.due_ns > self.now_ns
            self.host_does(host, host.session.grant(host.slots))

    def shoot(self) -> None:
        """The camera has a frame; it is sent if there is credit."""
        if self.camera_runs and self.board.has_credit:
            index = self.sent[self.board.session]
            frame = shot(index, self.now_ns, "board", size_px=(640, 480))
            if self._board_sends(frame_outgoing(self.board, frame)):
                self.board.sent(self.now_ns)
                self.clocks[self.board.session, index] = self.boot_id
                self.sent[self.board.session] += 1

    def settle(self, duration_ns: int = 2000 * MS) -> None:
        """Everything arrives at once and in order while time passes."""
        for _ in range(duration_ns // STEP_NS):
            self.pass_time(STEP_NS)
            self.deliver_all()

    def deliver_all(self) -> None:
        """Deliver everything under way, and the answers to it."""
        for _ in range(2000):
            moved = [
                self.deliver(host, place, to_board=to_board)
                for host in self.hosts
                for place in self.places
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

    # The behaviour of both sides' shells.

    def _new_board(self) -> BoardSession:
        self.lives += 1
        session = f"board-{self.lives}"
        self.sent[session] = 0
        dialled = tuple((place[1], _dialled(place)) for place in self.places) if self.board_dials else ()
        return BoardSession(session, self.boot_id, CAMERA, dialled)

    def board_name(self, host: HostNode, place: Place) -> bytes:
        """The board's name for a connection."""
        if self.board_dials:
            return _dialled(place)
        return next(name for name, (_, _, wire) in self.wires.items() if wire is host.wires[place])

    def _board_takes(self, host: HostNode, place: Place, message: Message | Broken) -> None:
        name = self.board_name(host, place)
        if isinstance(message, Broken):
            self.board_says(self.board.unreachable(name))
        else:
            self.board_says(self.board.receive(name, message, self.now_ns, self.counts))

    def board_says(self, said: list[Outgoing]) -> None:
        """Send what the board's session has said."""
        for outgoing in said:
            self._board_sends(outgoing)

    def _board_sends(self, outgoing: Outgoing) -> bool:
        found = self.wires.get(outgoing.connection)
        if found is None:
            self.board_says(self.board.unreachable(outgoing.connection))
            return False
        _, place, wire = found
        if isinstance(outgoing.message, FrameMessage):
            assert place[1] is Lane.FRAMES
            frame = outgoing.message
            assert frame.sent_index < self.credit.get(frame.session, 0), "a frame was sent without credit"
        wire.to_host.append(outgoing.message)
        return True

    def _host_takes(self, host: HostNode, place: Place, message: Message | Broken) -> None:
        name = host.names[place]
        if isinstance(message, Broken):
            self.host_does(host, host.session.interrupted(name, self.now_ns))
        else:
            self.host_does(host, host.session.receive(name, message, self.now_ns))

    def host_does(self, host: HostNode, outputs: list[Output]) -> None:
        """Do what a host's session has said, and check the invariants."""
        for output in outputs:
            match output:
                case Outgoing(connection, message):
                    self.host_sends(host, connection, message)
                case Accepted(hello=hello, resumed=resumed, lost=lost, link=link):
                    host.carriers.append(link)
                    host.accepted_boot_id = hello.boot_id
                    assert lost >= 0
                    assert resumed == (host.board_session == hello.session)
                    if not resumed:
                        host.board_session, host.base_sent = hello.session, hello.counts.sent
                        host.received = host.lost = 0
                    host.lost += lost
                case Arrived(frame, lost, _):
                    assert lost >= 0
                    assert frame.session == host.board_session, "a frame of an old session was taken"
                    known = self.clocks.get((frame.session, frame.sent_index), host.boot_id)
                    assert known == host.boot_id, "a frame was taken by a clock that is not its own"
                    newest = host.arrived[-1] if host.arrived else ("", -1)
                    assert newest[0] != frame.session or newest[1] < frame.sent_index, "a frame was taken twice or late"
                    host.arrived.append((frame.session, frame.sent_index))
                    host.received += 1
                    host.lost += lost
                case Stale():
                    host.stale.append(output)
                case Counted(_, _, lost):
                    assert lost >= 0
                    host.lost += lost
                case LinkUp(_, hello):
                    host.boot_id = hello.boot_id
                    host.others.append(output)
                case (
                    Echo()
                    | Refused()
                    | Vanished()
                    | LinkDown()
                    | OtherBoard()
                    | Stepped()
                    | Unbelievable()
                    | ClockVoid()
                ):
                    host.others.append(output)

    def host_sends(self, host: HostNode, connection: bytes, message: Message) -> None:
        """Send a message of a host."""
        if isinstance(message, Credit):
            known = self.credit.get(host.board_session, 0)
            self.credit[host.board_session] = max(known, message.below_index)
        for place, name in host.names.items():
            if name == connection:
                # A listener learns a connection's lane from a knock; a board that dials reports a mistake to it.
                assert self.board_dials or not isinstance(message, HostHello) or message.lane is place[1]
                host.wires[place].to_board.append(message)


def frame(session: str, sent_index: int) -> FrameMessage:
    """A frame as it was sent before."""
    return replace(FRAME, session=session, sent_index=sent_index)


def _dialled(place: Place) -> bytes:
    """The dialling side's name for a connection."""
    return connection_name(place[0], place[1].name.encode())
