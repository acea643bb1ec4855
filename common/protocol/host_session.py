"""The host's side of a session over one or several links: finds the board, grants credit, echoes clocks, separates fresh frames from stale ones.

Sans-I/O; `now_ns` is passed in. A link is open when the board answers a hello on its control lane. All open links lead to one life of one
board. Frames come over one of them, the carrier: the link on which the board last answered a hello for frames. That answer queues behind
the last frame of its lane and overtakes what is under way on other links. So any frame that it counts and that has not come is lost, and
a frame that comes behind a newer one stays lost (`StaleReason.LATE`). The session's owner chooses the carrier among the open links (`carry`).

The session trusts nothing that arrives: a refusal counts only on a lane that this side dialled, a frame only within the credit granted, an
account only up to that credit. Time in which this process did not run counts as nobody's silence.
"""

from collections.abc import Sequence
from typing import Final, assert_never

from common.protocol.absence import Presence
from common.protocol.host_carriage import Carriage
from common.protocol.host_path import HostPath
from common.protocol.host_stream import Stream
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    Credit,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Locks,
    LockState,
    Message,
    Ping,
    Pong,
    Refusal,
    SetLocks,
    Status,
    Steer,
)
from common.protocol.session import (
    HELLO_RETRY_NS,
    MS,
    TAKEOVER_NS,
    Accepted,
    Arrived,
    ClockVoid,
    Counted,
    LinkDown,
    LinkUp,
    LocksTold,
    OtherBoard,
    Outgoing,
    Output,
    Refused,
    Stale,
    StaleReason,
    Stepped,
    Unbelievable,
    Vanished,
)

_FOREIGN_RETRY_NS: Final = 5000 * MS
"""Retry time for a link that leads to another board, or refuses us while another link is open: someone may move the cable."""

_TOO_MANY: Final = Unbelievable("an account of more frames than were allowed")


class HostSession:
    """A host's view of its board.

    Args:
        host_id: random id of this process's life.
        links: for each link, the connections that this side opened. Empty where the board dials (`?bind=1`); its knocks then reveal them.
    """

    def __init__(self, host_id: str, links: Sequence[dict[Lane, bytes]]) -> None:
        self._host_id = host_id
        self._paths = tuple(HostPath(link, dialled) for link, dialled in enumerate(links))
        self._carriage = Carriage(host_id, self._paths)
        self._streams = False
        self._leaving = False
        self._stream: Stream | None = None
        self._boot_id = ""
        self._presence = Presence()
        self._due = lambda: self.due_ns

    @property
    def is_open(self) -> bool:
        """Whether a board sends its frames to us now."""
        return self._carriage.carrier is not None

    @property
    def carrier(self) -> int | None:
        """The link that frames come over now; None if there is none."""
        carrier = self._carriage.carrier
        return None if carrier is None else carrier.link

    @property
    def outstanding(self) -> int:
        """Frames that the board may still send against credit already granted."""
        stream = self._stream
        if stream is None or self._carriage.carrier is None or stream.below_index <= stream.next_index:
            return 0
        return stream.below_index - stream.next_index

    @property
    def due_ns(self) -> int:
        """When `tick` must be called next, host's clock, ns."""
        due_ns = self._carriage.due_ns
        for path in self._paths:
            due_ns = min(due_ns, path.due_ns)
        return due_ns

    def receive(  # noqa: PLR0911 - one line for each kind of message
        self, connection: bytes, message: Message, now_ns: int
    ) -> list[Output]:
        """Take one message from a connection.

        Args:
            connection: where it came from; its first byte is the link's number.
            message: what came.
            now_ns: arrival of its last byte on the host's clock, ns.
        """
        self._notice_absence(now_ns)
        path = self._paths[connection[0]]
        match message:
            case FrameMessage():
                taken = self.take_frame(path.link, message, now_ns)
                return [Stale(message, taken) if isinstance(taken, StaleReason) else Arrived(message, taken, path.link)]
            case Knock():
                return [] if self._leaving else self._answer_knock(path, connection, message, now_ns)
            case Refusal(reason):
                if connection not in path.dialled.values():
                    return []  # on a lane that others dial, the caller may be anybody
                if not path.is_open and any(other.is_open for other in self._paths):
                    path.shut(now_ns + _FOREIGN_RETRY_NS)  # our board is on another link: this is a different one
                return [Refused(reason, path.link)]
            case BoardHello():
                if connection == path.lanes.get(Lane.CONTROL):
                    return self._open(path, message, now_ns)
                return self._accept(path, message, now_ns) if connection == path.lanes.get(Lane.FRAMES) else []
            case HostHello() | Ping() | Credit() | Steer() | SetLocks():
                return []  # only a host sends these; a sound board never does
            case Pong() | Status() | End() | LockState():
                return self._attend(path, connection, message, now_ns)
            case Bye(counts):
                return self._take_goodbye(path, connection, counts, now_ns)
            case _:
                assert_never(message)

    def take_frame(self, link: int, frame: FrameMessage, now_ns: int) -> int | StaleReason:
        """Take a frame, as `receive` does, without making outputs of it: it comes thirty times a second.

        Returns:
            How many frames before it never came, or why it must not be used.
        """
        if (absent_ns := self._presence.absent_ns(self._due, now_ns)) > 0:
            self._excuse(absent_ns, now_ns)
        path, stream = self._paths[link], self._stream
        if stream is None or frame.session != stream.hello.session:
            return StaleReason.OLD_SESSION
        if stream.hello.boot_id != self._boot_id:
            return StaleReason.OLD_SESSION  # sent before a sleep, so its marks are on the earlier clock
        taken = stream.take(frame.sent_index)
        if isinstance(taken, StaleReason):
            return taken
        if path.hello is None:
            path.lived(now_ns)
        path.heard_ns = now_ns
        return taken

    def tick(self, now_ns: int) -> list[Output]:
        """Do what is due: repeat unanswered hellos, begin the next clock wave, give up a silent or stuck link."""
        self._notice_absence(now_ns)
        outputs: list[Output] = []
        for path in self._paths:
            if path.is_open and self._carriage.is_silent(path, now_ns):
                outputs += self._lose(path, now_ns)
        for path in self._paths:
            if not path.is_open:
                outputs += path.greet(self._host_id, now_ns)
            elif now_ns >= path.waves.due_ns:
                outputs += self._begin_wave(path, now_ns)
        return outputs + self._carriage.tick(now_ns)

    def carry(self, link: int, now_ns: int) -> list[Output]:
        """Ask the board to send frames over this link. Until it agrees, they come as before.

        Args:
            link: which one; a link that is not open is ignored.
            now_ns: host's clock, ns.
        """
        path = self._paths[link]
        return self._carriage.want(path, now_ns) if path.is_open and path is not self._carriage.wanted else []

    def grant(self, slots: int) -> list[Output]:
        """Grant the board credit for this many frames beyond the last one that came. Credit is never taken back."""
        carrier, stream = self._carriage.carrier, self._stream
        if carrier is None or stream is None or stream.next_index + slots <= stream.below_index:
            return []
        below_index = stream.below_index = stream.next_index + slots
        stream.granted_index = max(stream.granted_index, below_index)
        return [Outgoing(carrier.lanes[Lane.CONTROL], Credit(below_index))]

    def steer(self, later_ns: int) -> list[Output]:
        """Ask the board's camera to expose later, by less than its period, ns."""
        carrier = self._carriage.carrier
        return [] if carrier is None else [Outgoing(carrier.lanes[Lane.CONTROL], Steer(later_ns))]

    def set_locks(self, locks: Locks) -> list[Output]:
        """Ask the board to hold controls of its camera. A board that does not understand that is not asked."""
        carrier, stream = self._carriage.carrier, self._stream
        if carrier is None or stream is None or not stream.hello.is_long:
            return []
        return [Outgoing(carrier.lanes[Lane.CONTROL], SetLocks(locks))]

    def probe(self, now_ns: int) -> None:
        """Send the next echoes as soon as the lines permit: something waits for an answer younger than itself."""
        for path in self._paths:
            if path.is_open:
                path.waves.hasten(now_ns)

    def begin_clock(self, now_ns: int) -> list[Output]:
        """Record that this machine's clock stood still. All echoes under way are void, and so is the credit granted."""
        for path in self._paths:
            if path.is_open:
                path.waves.open(now_ns)
        return self._carriage.want_again(now_ns)

    def interrupted(self, connection: bytes, now_ns: int) -> list[Output]:
        """Record that a connection broke. What was under way on it is gone, so both lanes of its link are greeted again."""
        return self._lose(self._paths[connection[0]], now_ns)

    def leave(self) -> list[Output]:
        """Say goodbye, so that the board is free for another host at once. It answers with its last account."""
        self._leaving = True
        return [Outgoing(path.lanes[Lane.CONTROL], Bye()) for path in self._paths if path.is_open]

    # Links that come and go.

    def _answer_knock(self, path: HostPath, connection: bytes, knock: Knock, now_ns: int) -> list[Output]:
        lane = path.lane_of(connection, knock, now_ns)
        if lane is None:
            return []
        if lane is Lane.FRAMES and path.is_open:
            return self._carriage.want(path, now_ns) if path is self._carriage.wanted else []
        if path.is_open and knock.session == path.session and knock.lane is Lane.FRAMES:
            # The board knows us but has lost its frames lane, and says so on every other lane. The carrier must answer now or give way.
            path.heard_ns = now_ns
            return [] if self._carriage.pending else self._carriage.want_again(now_ns)
        # The board has forgotten us: one of the two was gone for a while, and its clock may have stood still in that time.
        void: list[Output] = [ClockVoid()] if path.is_open and knock.session == path.session else []
        return void + self._lose(path, now_ns)

    def _notice_absence(self, now_ns: int) -> None:
        """Do not count the time in which this process did not run as anyone's silence."""
        if (absent_ns := self._presence.absent_ns(self._due, now_ns)) > 0:
            self._excuse(absent_ns, now_ns)

    def _excuse(self, absent_ns: int, now_ns: int) -> None:
        for path in self._paths:
            path.heard_ns = min(now_ns, path.heard_ns + absent_ns)
        self._carriage.absent(absent_ns, now_ns)

    def _open(self, path: HostPath, hello: BoardHello, now_ns: int) -> list[Output]:
        """Handle a board's hello on a control lane."""
        if path.hello is not None:
            if path.hello.boot_id == hello.boot_id:
                return []  # the answer to a repeated hello
            return self._lose(path, now_ns) + self._open(path, hello, now_ns)  # the board has slept
        others = [other for other in self._paths if other.hello is not None and other.hello.session != hello.session]
        path.session = hello.session
        alive = [other for other in others if other.is_alive_beside(hello, now_ns)]
        if alive:
            return self._doubt(path, hello, max(other.heard_ns for other in alive), now_ns)
        outputs = [output for other in others for output in self._lose(other, now_ns)]
        path.open(hello, now_ns)
        self._boot_id = hello.boot_id
        outputs.append(LinkUp(path.link, hello))
        return outputs if self._carriage.wanted is not None else outputs + self._carriage.want(path, now_ns)

    def _doubt(self, path: HostPath, hello: BoardHello, others_heard_ns: int, now_ns: int) -> list[Output]:
        """Handle a link that leads to another life of a board: either it is new and the other links will fall silent, or it is another board."""
        if path.foreign_since_ns is None:
            path.foreign_since_ns = now_ns
        if now_ns - path.foreign_since_ns < TAKEOVER_NS or others_heard_ns <= path.foreign_since_ns:
            return []
        path.foreign_since_ns = None
        path.shut(now_ns + _FOREIGN_RETRY_NS)
        return [Outgoing(path.lanes[Lane.CONTROL], Bye()), OtherBoard(path.link, hello)]

    def _lose(self, path: HostPath, now_ns: int) -> list[Output]:
        """Give a link up and greet it again. Frames move to another link if there is one."""
        outputs: list[Output] = [LinkDown(path.link)] if path.is_open else []
        path.shut(now_ns)
        outputs += path.greet(self._host_id, now_ns)
        outputs += self._carriage.lose(path, now_ns)
        if self._streams and self._carriage.wanted is None:
            self._streams = False
            outputs.append(Vanished(orderly=False))
        return outputs

    # The frames lane.

    def _accept(self, path: HostPath, hello: BoardHello, now_ns: int) -> list[Output]:
        """Handle a board's hello on a frames lane."""
        if path.hello is None:
            return []
        if (path.hello.session, path.hello.boot_id) != (hello.session, hello.boot_id):
            return self._lose(path, now_ns)  # between the two lanes the board began a new life, or slept
        if path is not self._carriage.wanted:
            # The answer to an old hello: the board may now send its frames there.
            return self._carriage.want_again(now_ns)
        stream = self._stream
        resumed = stream is not None and stream.hello.session == hello.session
        if stream is None or not resumed:
            lost, stream = 0, Stream(hello, hello.rung.changes, hello.counts.sent, granted_index=hello.counts.sent)
            self._stream = stream
        else:
            lost = stream.resume(hello)
        path.heard_ns = now_ns
        if resumed and not self._carriage.pending:  # the answer to a repeated hello: credit is void again
            return [Counted(hello.counts, ended=False, lost=lost)]
        self._carriage.agree(path)
        self._streams = True
        stream.hello, stream.changes = hello, hello.rung.changes
        return [Accepted(hello=hello, resumed=resumed, lost=lost, link=path.link)]

    # Accounts and echoes.

    def _begin_wave(self, path: HostPath, now_ns: int) -> list[Output]:
        control = path.lanes[Lane.CONTROL]
        carrier = self._carriage.carrier
        echoes, ping = path.waves.begin_wave(now_ns, standby=path is not carrier)
        if ping is None:
            return []
        # Credit is granted up to an index. Repeating it is harmless, and replaces a grant that a broken connection swallowed.
        below_index = 0 if path is not carrier or self._stream is None else self._stream.below_index
        return [*echoes, Outgoing(control, ping), *([Outgoing(control, Credit(below_index))] if below_index else [])]

    def _attend(  # noqa: PLR0911 - one line for each kind of message
        self, path: HostPath, connection: bytes, message: Pong | Status | End | LockState, now_ns: int
    ) -> list[Output]:
        if path.hello is None or connection not in path.lanes.values():
            return []
        path.heard_ns = now_ns
        match message:
            case Pong():
                echoes, ping = path.waves.answered(message, now_ns)
                return [*echoes, *([] if ping is None else [Outgoing(path.lanes[Lane.CONTROL], ping)])]
            case LockState(session=session):
                return (
                    [LocksTold(message)] if self._stream is not None and session == self._stream.hello.session else []
                )
            case Status(session, counts) | End(session, counts):
                stream = self._stream
                if stream is None or session != stream.hello.session:
                    return []
                if not stream.can_be(counts):
                    return [_TOO_MANY]
                # A frame that this account counts and that has not come before it is lost.
                behind = connection == path.lanes.get(Lane.FRAMES)
                lost = stream.pass_over(counts.sent) if behind else 0
                told = Counted(counts, ended=isinstance(message, End), lost=lost)
                if isinstance(message, Status) and stream.is_news(message.rung):
                    return [Stepped(message.rung), told]
                return [told]
            case _:
                assert_never(message)

    def _take_goodbye(self, path: HostPath, connection: bytes, counts: BoardCounts, now_ns: int) -> list[Output]:
        """Handle a board's goodbye. It may come on one lane just after the other broke; its account is still the session's last."""
        stream = self._stream
        if stream is None or path.session != stream.hello.session or connection not in path.lanes.values():
            return []
        if counts.sent < stream.next_index:
            return []
        # Answer it, so that the board keeps the connection until its last words are read.
        answer, can_be = Outgoing(connection, Bye()), stream.can_be(counts)
        lost = stream.pass_over(counts.sent) if can_be and connection == path.lanes.get(Lane.FRAMES) else 0
        told = Counted(counts, ended=False, lost=lost, last=True) if can_be else _TOO_MANY
        if self._leaving:  # the board's answer to our own goodbye
            return [answer, told]
        for known in self._paths:
            if known.is_open:
                known.shut(now_ns + HELLO_RETRY_NS)
        self._carriage.end()
        self._streams = False
        return [answer, told, Vanished(orderly=can_be)]
