"""The host's side of a session: finds the board, grants credit, echoes clocks, tells fresh frames from stale. Sans-I/O, `now_ns` passed in."""

from enum import Enum
from typing import Final, assert_never

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
    Message,
    Ping,
    Pong,
    Refusal,
    Status,
    Steer,
)
from common.protocol.session import (
    HELLO_RETRY_NS,
    MS,
    SILENCE_NS,
    TAKEOVER_NS,
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

WAVE_ECHOES: Final = 3
WAVE_ECHOES_EARLY: Final = 5
"""Echoes back to back: the first wakes both sides up, the others measure without that bias (study of links, 3d)."""

WAVE_NS: Final = 500 * MS
"""Between two waves. An echo costs the board as much as half a frame (bench_link): 6 a second do for a clock whose skew is known."""

WAVE_YOUNG_NS: Final = 250 * MS
YOUNG_NS: Final = 10_000 * MS
"""So long after the beginning of a session the skew is hardly known, and an offset grows old quickly."""

REPEATS: Final = 5
SLOW_ECHO_NS: Final = 1 * MS
"""An echo that took longer than any swift link's says little; while the skew is learnt it is repeated, up to so many times a wave: errors
after ten seconds of Wi-Fi are halved by it (bench_clock)."""

WAVE_EARLY_NS: Final = 50 * MS
EARLY_NS: Final = 1000 * MS
"""In its first second there is no estimate worth the name."""

WAVE_PATIENCE_NS: Final = 1000 * MS
"""An echo under way is waited for this long before another wave: on a slow line a wave takes longer than the time between two."""

WAVE_REST: Final = 8
"""After a wave the line has this many times its length for other things: echoes at 115200 baud would else take 2 % of it."""

WAVE_REST_YOUNG: Final = 1
"""The same while the skew is learnt: 7 % of such a line for ten seconds."""


class _State(Enum):
    SEEKING = 0
    OPEN = 1


class HostSession:
    """A host's view of one link.

    Args:
        host_id: random id of this process's life.
        dialled: the connections that this side opened; empty when the board dials (`?bind=1`), then its knocks tell them.
    """

    def __init__(self, host_id: str, dialled: dict[Lane, bytes]) -> None:
        self._host_id = host_id
        self._lanes = dict(dialled)
        self._state = _State.SEEKING
        self._leaving = False
        self._greeted: dict[Lane, BoardHello] = {}
        self._hello: BoardHello | None = None
        self._opened_ns = 0
        self._heard_ns = 0
        self._hello_due_ns = 0
        self._wave_due_ns = 0
        self._wave = 0
        self._wave_ns = 0
        self._echoes_left = 0
        self._repeats_left = 0
        self._unanswered = False
        self._next_index = 0
        self._below_index = 0

    @property
    def is_open(self) -> bool:
        """Whether a board talks to us now."""
        return self._state is _State.OPEN

    @property
    def outstanding(self) -> int:
        """Frames that the board may still send against credit already granted."""
        return max(0, self._below_index - self._next_index) if self.is_open else 0

    @property
    def due_ns(self) -> int:
        """When `tick` wants to be called next, host's clock, ns."""
        if self._state is _State.OPEN:
            return min(self._wave_due_ns, self._heard_ns + SILENCE_NS)
        return self._hello_due_ns

    def receive(  # noqa: PLR0911 - one line for each kind of message
        self, connection: bytes, message: Message, now_ns: int
    ) -> list[Output]:
        """Take one message from a connection.

        Args:
            connection: where it came from.
            message: what came.
            now_ns: arrival of its last byte on the host's clock, ns.

        Returns:
            What to send, and what happened.
        """
        match message:
            case Knock():
                return self._answer_knock(connection, message, now_ns)
            case Refusal(reason):
                return [Refused(reason)]
            case BoardHello():
                return self._accept(connection, message, now_ns)
            case FrameMessage():
                return self._take_frame(message, now_ns)
            case HostHello() | Ping() | Credit() | Steer():
                return []  # a host's words from a board: nothing a sound board sends
            case Pong() | Status() | End():
                return self._attend(connection, message, now_ns)
            case Bye(counts):
                return self._part(connection, counts, now_ns)
            case _:
                assert_never(message)

    def tick(self, now_ns: int) -> list[Output]:
        """Do what time demands: hello again while unanswered, the next clock wave, give up a silent board."""
        if self._state is _State.OPEN and now_ns - self._heard_ns >= SILENCE_NS:
            return [Vanished(orderly=False), *self._seek(now_ns)]
        if self._state is _State.SEEKING and now_ns >= self._hello_due_ns:
            return self._say_hello(now_ns)
        if self._state is _State.OPEN and now_ns >= self._wave_due_ns:
            if self._unanswered and now_ns - self._wave_ns < WAVE_PATIENCE_NS:
                self._wave_due_ns = min(now_ns + WAVE_EARLY_NS, self._wave_ns + WAVE_PATIENCE_NS)
                return []
            self._wave_ns = now_ns
            age_ns = now_ns - self._opened_ns
            early = age_ns < EARLY_NS
            self._wave_due_ns = now_ns + (WAVE_EARLY_NS if early else WAVE_YOUNG_NS if age_ns < YOUNG_NS else WAVE_NS)
            self._wave += 1
            self._echoes_left = WAVE_ECHOES_EARLY if early else WAVE_ECHOES
            self._repeats_left = REPEATS if EARLY_NS <= age_ns < YOUNG_NS else 0
            # Credit is granted up to an index, so repeating it is harmless and mends one that a broken connection swallowed.
            credit: list[Output] = (
                [Outgoing(self._lanes[Lane.CONTROL], Credit(self._below_index))] if self._below_index else []
            )
            return [*self._ping(), *credit]
        return []

    def grant(self, slots: int) -> list[Output]:
        """Let the board have credit for this many frames beyond the last one that came; credit is never taken back.

        Args:
            slots: free places for frames now.
        """
        below_index = self._next_index + slots
        if self._state is not _State.OPEN or below_index <= self._below_index:
            return []
        self._below_index = below_index
        return [Outgoing(self._lanes[Lane.CONTROL], Credit(below_index))]

    def steer(self, later_ns: int) -> list[Output]:
        """Ask the board's camera to expose later.

        Args:
            later_ns: by how much, less than its period.
        """
        return [Outgoing(self._lanes[Lane.CONTROL], Steer(later_ns))] if self._state is _State.OPEN else []

    def interrupted(self, now_ns: int) -> list[Output]:
        """Take note that a connection broke: what was under way on it is gone, so both lanes are greeted anew."""
        was_open = self.is_open
        return [*([Vanished(orderly=False)] if was_open else []), *self._seek(now_ns)]

    def leave(self) -> list[Output]:
        """Say goodbye, so that the board is free for another host at once; its last account answers."""
        self._leaving = True
        return [Outgoing(self._lanes[Lane.CONTROL], Bye())] if self._state is _State.OPEN else []

    def _answer_knock(self, connection: bytes, knock: Knock, now_ns: int) -> list[Output]:
        if connection not in self._lanes.values():  # a board that dials
            ours = self._hello is not None and knock.session == self._hello.session
            if self._state is _State.OPEN and not ours and now_ns - self._heard_ns < TAKEOVER_NS:
                return []  # a second board; the first is alive
            self._lanes[knock.lane] = connection
        return self.interrupted(now_ns)

    def _seek(self, now_ns: int) -> list[Output]:
        self._state = _State.SEEKING
        self._greeted.clear()
        return self._say_hello(now_ns)

    def _say_hello(self, now_ns: int) -> list[Output]:
        self._hello_due_ns = now_ns + HELLO_RETRY_NS
        return [
            Outgoing(connection, HostHello(self._host_id, lane))
            for lane, connection in self._lanes.items()
            if lane not in self._greeted
        ]

    def _accept(self, connection: bytes, hello: BoardHello, now_ns: int) -> list[Output]:
        if self._state is _State.OPEN:
            return []  # the answer to a hello that was said twice
        # Both lanes must lead to the same life of the board: an answer from before its restart may still be under way on one of them.
        self._greeted = {lane: said for lane, said in self._greeted.items() if said.session == hello.session}
        self._greeted |= {lane: hello for lane, known in self._lanes.items() if known == connection}
        if set(self._greeted) != set(Lane):
            return []
        hello = self._greeted[Lane.FRAMES]  # stands in line with the frames: what it counts and has not come is lost
        resumed = self._hello is not None and self._hello.session == hello.session
        lost = max(0, hello.counts.sent - self._next_index) if resumed else 0
        self._next_index = self._next_index + lost if resumed else hello.counts.sent
        self._below_index = 0
        self._wave += 1  # echoes under way are of an earlier connection, perhaps of another clock
        self._echoes_left = 0
        self._unanswered = False
        self._hello = hello
        self._state = _State.OPEN
        self._opened_ns = self._heard_ns = self._wave_due_ns = now_ns
        return [Accepted(hello, resumed, lost)]

    def _take_frame(self, frame: FrameMessage, now_ns: int) -> list[Output]:
        if self._hello is None or frame.session != self._hello.session:
            return [Stale(frame, old_session=True)]
        if frame.sent_index < self._next_index:
            return [Stale(frame, old_session=False)]
        lost = frame.sent_index - self._next_index
        self._next_index = frame.sent_index + 1
        self._heard_ns = now_ns
        return [Arrived(frame, lost)]

    def _attend(self, connection: bytes, message: Pong | Status | End, now_ns: int) -> list[Output]:
        if self._state is not _State.OPEN or self._hello is None or connection not in self._lanes.values():
            return []
        self._heard_ns = now_ns
        match message:
            case Pong(wave, t0_ns, t1_ns, t2_ns):
                if wave != self._wave:
                    return []
                self._unanswered = False
                if self._repeats_left and now_ns - t0_ns >= SLOW_ECHO_NS:
                    self._repeats_left -= 1
                    self._echoes_left += 1
                age_ns = now_ns - self._opened_ns
                if not self._echoes_left and age_ns >= EARLY_NS:
                    rest = WAVE_REST_YOUNG if age_ns < YOUNG_NS else WAVE_REST
                    rest_ns = min(WAVE_PATIENCE_NS, rest * (now_ns - self._wave_ns))
                    self._wave_due_ns = max(self._wave_due_ns, now_ns + rest_ns)
                return [Echo(wave, t0_ns, t1_ns, t2_ns, now_ns), *self._ping()]
            case Status(session, counts) | End(session, counts):
                if session != self._hello.session:
                    return []
                behind = connection == self._lanes[Lane.FRAMES]
                lost = self._settle(counts) if behind else 0
                return [Counted(counts, isinstance(message, End), lost, last=behind and self._leaving)]
            case _:
                assert_never(message)

    def _part(self, connection: bytes, counts: BoardCounts, now_ns: int) -> list[Output]:
        """Take a board's goodbye. It may come on one lane just after the other one broke: its account is the session's last all the same."""
        if self._hello is None or connection not in self._lanes.values() or counts.sent < self._next_index:
            return []
        if self._state is _State.OPEN:
            self._state = _State.SEEKING
            self._greeted.clear()
            self._hello_due_ns = now_ns + HELLO_RETRY_NS
        lost = self._settle(counts) if connection == self._lanes.get(Lane.FRAMES) else 0
        # Answered, so that the board keeps the connection until its last words were read.
        return [Outgoing(connection, Bye()), Counted(counts, ended=False, lost=lost, last=True), Vanished(orderly=True)]

    def _settle(self, counts: BoardCounts) -> int:
        """Take an account that came behind the last frame: what it tells of and has not come is lost. Gives how many."""
        lost = max(0, counts.sent - self._next_index)
        self._next_index += lost
        return lost

    def _ping(self) -> list[Output]:
        if not self._echoes_left:
            return []
        self._echoes_left -= 1
        self._unanswered = True
        return [Outgoing(self._lanes[Lane.CONTROL], Ping(self._wave, 0))]
