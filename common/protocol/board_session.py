"""The board's side of a session: serves one host at a time, over all links on which that host says hello. Sans-I/O, `now_ns` passed in.

The board sends a frame only against credit, and always over one link: the one on which the host last said hello for frames. The other links
carry echoes and hellos. So the host decides where frames go. The answer to its hello queues behind the last frame that can still
come from anywhere. Any frame that this answer counts and that has not come is therefore lost.
"""

from dataclasses import dataclass, field
from typing import assert_never

from common.orientation import UPRIGHT
from common.protocol.absence import Presence
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
    Locks,
    LockState,
    Message,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    SetLocks,
    Status,
    Steer,
)
from common.protocol.terms import HELLO_RETRY_NS, MS, SILENCE_NS, STATUS_NS, STATUS_SLOW_NS, TAKEOVER_NS, Outgoing

_NEVER = 2**63 - 1

STEER_REST_NS = 500 * MS
"""A camera is steered at most this often. A host must first see the effect, which takes longer than this."""

LOCK_REST_NS = 500 * MS
"""Controls are set at most this often: some webcams give no frame while they are."""


@dataclass(slots=True)
class _Host:
    """The host being served.

    Attributes:
        host_id: its random id.
        heard_ns: when it was last heard, over any link.
        status_due_ns: when it is next sent the account.
        silence_due_ns: earliest time at which any of its links can have been silent for too long.
        heard_by: when it was last heard, by link.
        frames: the connection that frames go to; None if it was lost.
        controls: the control connections, by link.
        below_index: frames below this index may be sent.
        reads_long: whether it reads long hellos and `LockState`.
        knows_locks: whether it has been told how the camera is held.
    """

    host_id: str
    heard_ns: int
    status_due_ns: int
    silence_due_ns: int
    heard_by: dict[int, int] = field(default_factory=dict)
    frames: bytes | None = None
    controls: dict[int, bytes] = field(default_factory=dict)
    below_index: int = 0
    reads_long: bool = False
    knows_locks: bool = False

    @property
    def account_lane(self) -> bytes | None:
        """The control connection of the link that carries frames; any other one if there is none."""
        beside = None if self.frames is None else self.controls.get(self.frames[0])
        return beside if beside is not None else next(iter(self.controls.values()), None)

    def excuse(self, absent_ns: int, now_ns: int) -> None:
        """Do not count the time in which this process did not run as this host's silence. Negative: the clock went back."""
        self.status_due_ns += min(0, absent_ns)
        self.heard_ns = min(now_ns, self.heard_ns + absent_ns)
        self.heard_by = {link: min(now_ns, heard_ns + absent_ns) for link, heard_ns in self.heard_by.items()}
        self.silence_due_ns = min(self.heard_by.values(), default=now_ns) + SILENCE_NS

    def knows(self, connection: bytes) -> bool:
        """Whether a connection belongs to this host."""
        return connection == self.frames or self.controls.get(connection[0]) == connection

    def heard(self, connection: bytes, now_ns: int) -> None:
        """Record that the host was heard on a connection."""
        self.heard_ns = self.heard_by[connection[0]] = now_ns

    def lose(self, connection: bytes) -> None:
        """Forget a connection."""
        if connection == self.frames:
            self.frames = None
        if self.controls.get(connection[0]) == connection:
            del self.controls[connection[0]]

    def lose_silent_links(self, now_ns: int) -> None:
        """Forget the links that have been silent for too long."""
        for link in [link for link, heard_ns in self.heard_by.items() if now_ns - heard_ns >= SILENCE_NS]:
            del self.heard_by[link]
            self.controls.pop(link, None)
            if self.frames is not None and self.frames[0] == link:
                self.frames = None
        self.silence_due_ns = min(self.heard_by.values(), default=now_ns) + SILENCE_NS


class BoardSession:
    """One life of a board process.

    Attributes:
        session: its id.
        next_index: the next frame's number among those sent. `sent` spends the credit.

    Args:
        session: random id of this process's life.
        boot_id: identifies this life of the machine's clock.
        camera: what the host must know about the camera.
        dialled: the connections that this side opened itself (`?connect=1`), on all links; empty when the host dials.
    """

    def __init__(
        self, session: str, boot_id: str, camera: CameraDescription, dialled: tuple[tuple[Lane, bytes], ...] = ()
    ) -> None:
        self.session = session
        self._boot_id = boot_id
        self._camera = camera
        self._rung = Rung(period_ns=camera.period_ns)
        self._dialled = dialled
        self._knock_due_ns = 0
        self._host: _Host | None = None
        self.next_index = 0
        self._sent_ns = 0
        self._status_ns = STATUS_NS
        self._ended = False
        self._later_ns = 0
        self._steered_ns = -STEER_REST_NS
        self._held: Locks = ()
        self._asked: Locks | None = None
        self._is_asked = False
        self._locked_ns = -LOCK_REST_NS
        self._leaving = False
        self._presence = Presence()

    @property
    def carrier(self) -> int | None:
        """Index of the link that carries frames; None if there is none."""
        frames = None if self._host is None else self._host.frames
        return None if frames is None else frames[0]

    @property
    def has_host(self) -> bool:
        """Whether there is a host to which frames can be sent now or soon."""
        host = self._host
        return host is not None and (host.frames is not None or bool(host.controls))

    @property
    def cannot_turn(self) -> bool:
        """Whether there is a host that is too old to be told that this camera's images must be turned."""
        return self._host is not None and not self._host.reads_long and self._camera.orientation != UPRIGHT

    def begin_clock(self, boot_id: str) -> None:
        """Record that this machine has slept and its clock stood still. The host must greet again and learn the clock from scratch."""
        self._boot_id = boot_id
        self._host = None

    def describe(self, camera: CameraDescription, rung: Rung) -> None:
        """Record that the camera delivers something else from now on. The next account tells the host; it becomes due now."""
        self._camera, self._rung = camera, rung
        if self._host is not None:
            self._host.status_due_ns = 0

    def hold(self, held: Locks) -> None:
        """Record which controls of the camera are held, and with which values. The host is told now if it reads that."""
        self._held = held
        host = self._host
        if host is not None and host.reads_long:
            host.knows_locks, host.status_due_ns = False, 0

    @property
    def has_credit(self) -> bool:
        """Whether the next frame may be sent now."""
        return self.frames_lane is not None

    @property
    def frames_lane(self) -> bytes | None:
        """The connection to which the next frame may be sent now; None without credit."""
        host = self._host
        return None if host is None or self.next_index >= host.below_index else host.frames

    def receive(  # noqa: PLR0911 - one line for each kind of message
        self, connection: bytes, message: Message, now_ns: int, counts: BoardCounts
    ) -> list[Outgoing]:
        """Take one message from a connection."""
        self._notice_absence(now_ns)
        if isinstance(message, HostHello):
            # An answer after the goodbye would begin the session anew, only for it to vanish.
            return [] if self._leaving else self._greet(connection, message, now_ns, counts)
        host = self._host
        if host is None or not host.knows(connection):
            # Someone from before a restart, or a stranger. Clock echoes run on the control lane, so knock for that one.
            is_mute = self._leaving or isinstance(message, Bye)
            return [] if is_mute else [Outgoing(connection, Knock(Lane.CONTROL, self.session))]
        host.heard(connection, now_ns)
        match message:
            case Ping(wave, t0_ns):
                return [Outgoing(connection, Pong(wave=wave, t0_ns=t0_ns, t1_ns=now_ns, t2_ns=now_ns))]
            case Credit(below_index):
                host.below_index = max(host.below_index, below_index)
                return []
            case Steer(later_ns):
                # A host that never stops steering would leave the camera no time to expose.
                if now_ns - self._steered_ns >= STEER_REST_NS:
                    self._later_ns, self._steered_ns = later_ns % self._camera.period_ns, now_ns
                return []
            case SetLocks(locks):
                if self._asked != locks and now_ns - self._locked_ns >= LOCK_REST_NS:
                    self._asked, self._is_asked, self._locked_ns = locks, True, now_ns
                elif self._asked == locks:
                    host.knows_locks = False  # the answer was lost
                return []
            case Bye():
                # The final account goes behind the last frame, so any frame that it counts and that has not come is lost. It is not a
                # Status: one of those may be under way from before the host's last credit came, with frames behind it.
                self._host = None
                return [] if host.frames is None else [Outgoing(host.frames, Bye(counts))]
            case BoardHello() | Knock() | Refusal() | FrameMessage() | Pong() | Status() | End() | LockState():
                return []  # only a board sends these; a sound host never does
            case _:
                assert_never(message)

    def take_steering(self) -> int:
        """Return by how much the host wants the camera to expose later, ns, and forget it. 0: the host wants nothing."""
        later_ns, self._later_ns = self._later_ns, 0
        return later_ns

    def take_locks(self) -> Locks:
        """Return the controls that the host wants held, and forget that it asked. Empty: it wants nothing. `hold` must follow."""
        locks = self._asked if self._is_asked and self._asked is not None else ()
        self._is_asked = False
        return locks

    def tick(self, now_ns: int, counts: BoardCounts, ahead_ns: int = 0) -> list[Outgoing]:
        """Do what is due: send the account, give up a silent host, knock on connections that this side dialled.

        Args:
            now_ns: the board's clock, ns.
            counts: the current account of this session's frames.
            ahead_ns: an account that will be due within this time is sent now: the board is awake for another reason.
        """
        self._notice_absence(now_ns)
        outgoing: list[Outgoing] = []
        host = self._host
        if host is not None and now_ns >= host.silence_due_ns:
            host.lose_silent_links(now_ns)
            if not host.heard_by:
                self._host = host = None
        if host is not None and now_ns + ahead_ns >= host.status_due_ns:
            host.status_due_ns = now_ns + self._status_ns
            outgoing += self._account(host, counts)
        if self._dialled and now_ns >= self._knock_due_ns:
            outgoing += [
                Outgoing(connection, Knock(lane, self.session))
                for lane, connection in self._dialled
                if host is None or not host.knows(connection)
            ]
            self._knock_due_ns = now_ns + HELLO_RETRY_NS
        return outgoing

    @property
    def due_ns(self) -> int:
        """When `tick` must be called next, board's clock, ns."""
        due = self._knock_due_ns if self._dialled else _NEVER
        if self._host is not None:
            due = min(due, self._host.silence_due_ns, self._host.status_due_ns)
        return due

    def sent(self, now_ns: int) -> None:
        """Record that the link took the frame. Where frames are far apart, accounts become rarer too."""
        apart_ns = now_ns - self._sent_ns if self.next_index else 0
        self._status_ns = STATUS_NS if apart_ns < STATUS_SLOW_NS else STATUS_SLOW_NS
        self.next_index, self._sent_ns = self.next_index + 1, now_ns

    def unreachable(self, connection: bytes) -> list[Outgoing]:
        """Record that a connection is gone. A host still heard on other links, but without a frames lane, is asked to say hello again."""
        host = self._host
        if host is None or not host.knows(connection):
            return []  # a stranger's connection does not concern the host
        host.lose(connection)
        return self._ask_for_frames_lane(host)

    def end(self, counts: BoardCounts) -> list[Outgoing]:
        """Tell the host, behind the last frame, that no more will follow. From now on `tick` repeats this."""
        self._ended = True
        host = self._host
        return [] if host is None or host.frames is None else [Outgoing(host.frames, End(self.session, counts))]

    def leave(self, counts: BoardCounts) -> list[Outgoing]:
        """Say goodbye to the host with the final account: behind the last frame if there is a frames lane.

        From now on nobody is greeted.
        """
        self._leaving = True
        host = self._host
        connection = None if host is None else host.frames if host.frames is not None else host.account_lane
        return [] if connection is None else [Outgoing(connection, Bye(counts))]

    def _notice_absence(self, now_ns: int) -> None:
        """Time in which this process did not run does not count as the host's silence. What was due is due as soon by a clock that went back."""
        absent_ns = self._presence.absent_ns(lambda: self.due_ns, now_ns)
        back_ns = min(0, absent_ns)
        self._knock_due_ns += back_ns
        self._steered_ns += back_ns
        self._locked_ns += back_ns
        if self._host is not None and absent_ns:
            self._host.excuse(absent_ns, now_ns)

    def _ask_for_frames_lane(self, host: _Host) -> list[Outgoing]:
        """Tell a known host that its frames lane is not known. A knock for the control lane would say that the host is unknown too."""
        if host.frames is not None:
            return []
        return [Outgoing(control, Knock(Lane.FRAMES, self.session)) for control in host.controls.values()]

    def _account(self, host: _Host, counts: BoardCounts) -> list[Outgoing]:
        """Send the account of the frames, and repair what a lost packet would otherwise leave broken for ever.

        A frame lost without a trace takes its credit with it; the account sent behind the last frame, on the frames lane, reveals that. A lost
        knock leaves a host without its frames lane.
        """
        outgoing: list[Outgoing] = []
        if (control := host.account_lane) is not None:
            outgoing.append(Outgoing(control, Status(self.session, counts, self._rung)))
            if host.reads_long and not host.knows_locks and (self._held or self._asked is not None):
                host.knows_locks = True
                outgoing.append(
                    Outgoing(control, LockState(session=self.session, asked=self._asked or (), held=self._held))
                )
        outgoing += self._ask_for_frames_lane(host)
        if self._ended:
            outgoing += self.end(counts)
        elif host.frames is not None and not self.has_credit:
            outgoing.append(Outgoing(host.frames, Status(self.session, counts, self._rung)))
        return outgoing

    def _greet(self, connection: bytes, hello: HostHello, now_ns: int, counts: BoardCounts) -> list[Outgoing]:
        host = self._host
        if host is not None and host.host_id != hello.host_id and now_ns - host.heard_ns < TAKEOVER_NS:
            return [Outgoing(connection, Refusal(RefusalReason.BUSY))]
        own = next((lane for lane, known in self._dialled if known == connection), hello.lane)
        if own is not hello.lane:
            # The host took a knock for the frames lane, sent over a newly dialled control lane, for this lane's own. It has
            # forgotten the right connection, so that one must be knocked on again.
            if host is not None and host.frames is not None and host.frames[0] == connection[0]:
                host.frames = None
            return [Outgoing(connection, Knock(own, self.session))]
        if host is None or host.host_id != hello.host_id:
            self._host = host = _Host(hello.host_id, now_ns, now_ns + STATUS_NS, now_ns + SILENCE_NS)
        host.heard(connection, now_ns)
        host.reads_long, host.knows_locks = hello.reads_long, False
        if hello.lane is Lane.FRAMES:
            host.below_index = self.next_index  # credit from an earlier connection is void
            host.frames = connection
        else:
            host.controls[connection[0]] = connection
        told = BoardHello(
            session=self.session,
            boot_id=self._boot_id,
            camera=self._camera if hello.reads_long else self._camera.in_short(),
            counts=counts,
            rung=self._rung,
            is_long=hello.reads_long,
        )
        return [Outgoing(connection, told)]
