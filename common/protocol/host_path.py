"""A host's links: whether the board answers on one, its clock waves (echoes, many at first, few later), and which one carries frames. Sans-I/O, `now_ns` passed in.

The board agrees to carry frames over a link by answering a hello on that link's frames lane. Until then frames come as before.
"""

from collections.abc import Sequence
from typing import Final

from common.protocol.message import BoardHello, HostHello, Knock, Lane, Ping, Pong
from common.protocol.session import HELLO_RETRY_NS, MS, SILENCE_NS, TAKEOVER_NS, Echo, LinkDown, Outgoing, Output

WAVE_ECHOES: Final = 3
WAVE_ECHOES_EARLY: Final = 5
"""Echoes back to back. The first wakes both sides; the others measure without that bias (study of links, 3d)."""

WAVE_ECHOES_OLD: Final = 2
"""The same after the first minute, unless one of them is slow. Old facts hold the offset by then, so one swift echo a second is enough (bench_clock)."""

WAVE_NS: Final = 500 * MS
"""Time between two waves once the skew is known. An echo costs the board as much as half a frame (bench_link)."""

WAVE_OLD_NS: Final = 1000 * MS
"""The same after the first minute. The skew is known so well then that an offset ages by nanoseconds a second (bench_clock), and each wave
costs both sides as much processor time as a frame. A frame whose transit time is unusual asks for an echo at once."""

OLD_NS: Final = 60_000 * MS

WAVE_STANDBY_NS: Final = 1000 * MS
"""The same on a link that carries no frames. It only needs to show that it is alive and how long its delay is."""

WAVE_YOUNG_NS: Final = 250 * MS
YOUNG_NS: Final = 10_000 * MS
"""For this long after a session begins the skew is hardly known, and an offset quickly becomes outdated."""

REPEATS: Final = 5
SLOW_ECHO_NS: Final = 1 * MS
"""A slower echo than any fast link's says little. While the skew is being learnt it is repeated, up to a limit per wave. This halves the
errors after ten seconds of Wi-Fi (bench_clock)."""

_REPEATS_OLD: Final = WAVE_ECHOES - WAVE_ECHOES_OLD
"""On a slow link an old session's wave is as long as a younger one's."""

WAVE_EARLY_NS: Final = 50 * MS
EARLY_NS: Final = 1000 * MS
"""In the first second of a session there is no usable estimate."""

WAVE_HASTE_NS: Final = 10 * MS
"""Time from the start of one wave to the next while something waits for an echo: a frame, or the end of a doubt."""

WAVE_PATIENCE_NS: Final = 1000 * MS
"""How long to wait for an echo under way before another wave. On a slow line a wave takes longer than the time between two."""

WAVE_REST: Final = 8
"""After a wave the line is left to other traffic for this many times the wave's length. Otherwise echoes take 2 % of 115200 baud."""

WAVE_REST_YOUNG: Final = 1
"""The same while the skew is being learnt: 7 % of such a line for ten seconds."""


class Waves:
    """The echoes of one link.

    Args:
        link: its number; echoes carry it.
    """

    def __init__(self, link: int) -> None:
        self._link = link
        self._opened_ns = 0
        self._due_ns = 0
        self._wave = self._first_wave = 0
        self._wave_ns = 0
        self._echoes_left = 0
        self._repeats_left = 0
        self._unanswered = False
        self._kept: list[Echo] = []

    @property
    def due_ns(self) -> int:
        """When `begin_wave` must be called next, host's clock, ns."""
        return self._due_ns

    def open(self, now_ns: int) -> None:
        """Record that the link came up. Echoes under way belong to an earlier connection, perhaps to another clock."""
        self._wave += 1
        self._first_wave = self._wave
        self._echoes_left = 0
        self._kept.clear()
        self._unanswered = False
        self._opened_ns = self._due_ns = now_ns

    def hasten(self, now_ns: int) -> None:
        """Let the next wave begin as soon as the current one has ended."""
        if not self._unanswered:
            self._due_ns = min(self._due_ns, max(now_ns, self._wave_ns + WAVE_HASTE_NS))

    def begin_wave(self, now_ns: int, *, standby: bool) -> tuple[list[Echo], Ping | None]:
        """Begin the wave that is due.

        Args:
            now_ns: host's clock, ns.
            standby: whether the link carries no frames.

        Returns:
            Echoes of the previous wave if it was cut short, and the first question; None while the previous wave is still under way.
        """
        if self._unanswered and now_ns - self._wave_ns < WAVE_PATIENCE_NS:
            self._due_ns = min(now_ns + WAVE_EARLY_NS, self._wave_ns + WAVE_PATIENCE_NS)
            return [], None
        self._wave_ns = now_ns
        age_ns = now_ns - self._opened_ns
        early = age_ns < EARLY_NS
        old_ns = WAVE_STANDBY_NS if standby else WAVE_NS if age_ns < OLD_NS else WAVE_OLD_NS
        self._due_ns = now_ns + (WAVE_EARLY_NS if early else WAVE_YOUNG_NS if age_ns < YOUNG_NS else old_ns)
        self._wave += 1
        self._echoes_left = WAVE_ECHOES_EARLY if early else WAVE_ECHOES if age_ns < OLD_NS else WAVE_ECHOES_OLD
        self._repeats_left = (
            0 if early or YOUNG_NS <= age_ns < OLD_NS else REPEATS if age_ns < YOUNG_NS else _REPEATS_OLD
        )
        return self._given(), self._ping()

    def answered(self, pong: Pong, now_ns: int) -> tuple[list[Echo], Ping | None]:
        """Handle an answer. One from before the link came up is ignored, because it may be from another clock.

        An answer to an older wave is a fact like any other, but triggers no further question. Where a round trip takes longer than the wait for a
        wave, all answers are of that kind. A fast echo is kept until its wave has ended: learning from it takes longer than the echo did, so the
        board's processor would go idle meanwhile and wake late, and every question would travel longer than its answer (decision 0009).

        Returns:
            Echoes to learn from, and the wave's next question, if there is one.
        """
        if self._first_wave < pong.wave < self._wave:
            return [self._echo(pong, now_ns)], None
        if pong.wave != self._wave:
            return [], None
        self._unanswered = False
        if self._repeats_left and now_ns - pong.t0_ns >= SLOW_ECHO_NS:
            self._repeats_left -= 1
            self._echoes_left += 1
        age_ns = now_ns - self._opened_ns
        if not self._echoes_left and age_ns >= EARLY_NS:
            rest = WAVE_REST_YOUNG if age_ns < YOUNG_NS else WAVE_REST
            rest_ns = min(WAVE_PATIENCE_NS, rest * (now_ns - self._wave_ns))
            self._due_ns = max(self._due_ns, now_ns + rest_ns)
        self._kept.append(self._echo(pong, now_ns))
        ping = self._ping()
        swift = now_ns - pong.t0_ns < SLOW_ECHO_NS
        return [] if swift and ping is not None else self._given(), ping

    def _echo(self, pong: Pong, now_ns: int) -> Echo:
        return Echo(wave=pong.wave, t0_ns=pong.t0_ns, t1_ns=pong.t1_ns, t2_ns=pong.t2_ns, t3_ns=now_ns, link=self._link)

    def _given(self) -> list[Echo]:
        echoes, self._kept = self._kept, []
        return echoes

    def _ping(self) -> Ping | None:
        if not self._echoes_left:
            return None
        self._echoes_left -= 1
        self._unanswered = True
        return Ping(self._wave, 0)


MOST_SILENCE_NS: Final = 30_000 * MS
"""The longest silence tolerated on a link where frames are known to take long."""


class HostPath:
    """The state of one link.

    Args:
        link: its number.
        dialled: the connections that this side opened; empty when the board dials, whose knocks then reveal them.
    """

    def __init__(self, link: int, dialled: dict[Lane, bytes]) -> None:
        self.link = link
        self.dialled = dict(dialled)
        self.lanes = dict(dialled)
        self.waves = Waves(link)
        self.hello: BoardHello | None = None
        self.session = ""
        self.opened_ns = 0
        self.heard_ns = 0
        self.foreign_since_ns: int | None = None
        self.silence_ns = SILENCE_NS
        self._hello_due_ns = 0

    @property
    def is_open(self) -> bool:
        """Whether our board answers here."""
        return self.hello is not None

    @property
    def due_ns(self) -> int:
        """When the session must next act for this link, ns."""
        return self._hello_due_ns if self.hello is None else min(self.waves.due_ns, self.heard_ns + self.silence_ns)

    def is_alive_beside(self, hello: BoardHello, now_ns: int) -> bool:
        """Whether the board on this link is still alive, although another life of a board has said this hello on another link.

        A new life on the same boot means that the old one died, unless it was heard recently. A boot takes longer than the tolerated silence.
        """
        same_boot = self.hello is not None and self.hello.boot_id == hello.boot_id
        return not same_boot or now_ns - self.heard_ns < TAKEOVER_NS

    def lane_of(self, connection: bytes, knock: Knock, now_ns: int) -> Lane | None:
        """Return the lane that a knock speaks for. A board that dials names it itself.

        Args:
            connection: where it came from.
            knock: what came.
            now_ns: host's clock, ns.

        Returns:
            The lane; None if a second board knocks while the first is alive.
        """
        lane = next((lane for lane, known in self.lanes.items() if known == connection), None)
        if lane is None:  # a board that dials
            if self.is_open and knock.session != self.session and now_ns - self.heard_ns < TAKEOVER_NS:
                return None
            lane = knock.lane
            self.lanes[lane] = connection
        elif lane is Lane.FRAMES and knock.lane is Lane.CONTROL and not self.dialled:
            # This connection had been taken for the frames lane.
            del self.lanes[lane]
            lane = Lane.CONTROL
            self.lanes[lane] = connection
        return lane

    def open(self, hello: BoardHello, now_ns: int) -> None:
        """Record that our board answers."""
        self.hello = hello
        self.foreign_since_ns = None
        self.opened_ns = self.heard_ns = now_ns
        self.waves.open(now_ns)

    def lived(self, now_ns: int) -> None:
        """Record a frame that came after the link was given up as silent. On a slow link, everything else waits behind a frame."""
        self.silence_ns = min(MOST_SILENCE_NS, max(self.silence_ns, 2 * (now_ns - self.heard_ns)))

    def shut(self, hello_due_ns: int) -> None:
        """Record that the board is no longer there. It is greeted again from `hello_due_ns` on."""
        self.hello = None
        self._hello_due_ns = hello_due_ns

    def greet(self, host_id: str, now_ns: int) -> list[Outgoing]:
        """Say hello on the control lane, if one is due."""
        if self.hello is not None or now_ns < self._hello_due_ns:
            return []
        self._hello_due_ns = now_ns + HELLO_RETRY_NS
        return self.say_hello(host_id, Lane.CONTROL)

    def say_hello(self, host_id: str, lane: Lane) -> list[Outgoing]:
        """Say hello on a lane, if its connection is known."""
        return [Outgoing(self.lanes[lane], HostHello(host_id, lane, reads_long=True))] if lane in self.lanes else []


STUCK_NS: Final = 1000 * MS
"""A link whose frames lane leaves a hello unanswered for this long gives way to another. This is five hellos."""

SILENCE_BESIDE_NS: Final = 1500 * MS
"""The carrier is lost when it is silent for this long while another link was heard: three accounts and three waves are missing."""

_NEVER: Final = 2**63 - 1


class Carriage:
    """The link that carries frames now, and the link that shall carry them.

    Attributes:
        carrier: the link that carries frames now; None if there is none.
        wanted: the link that shall carry them; None if there is none.
        pending: whether the board has yet to agree to `wanted`.
    """

    def __init__(self, host_id: str, paths: Sequence[HostPath]) -> None:
        self._host_id = host_id
        self._paths = paths
        self.carrier: HostPath | None = None
        self.wanted: HostPath | None = None
        self.pending = False
        self._pending_since_ns = 0
        self._hello_due_ns = 0

    @property
    def due_ns(self) -> int:
        """When `tick` must be called next, host's clock, ns."""
        return self._hello_due_ns if self.pending else _NEVER

    def tick(self, now_ns: int) -> list[Output]:
        """Repeat an unanswered hello for frames."""
        return self._insist(now_ns) if self.pending and now_ns >= self._hello_due_ns else []

    def want(self, path: HostPath, now_ns: int) -> list[Output]:
        """Ask for frames over an open link."""
        self.wanted, self.pending, self._pending_since_ns = path, True, now_ns
        return self._insist(now_ns)

    def want_again(self, now_ns: int) -> list[Output]:
        """Say hello for frames again on the wanted link, if there is one."""
        return [] if self.wanted is None else self.want(self.wanted, now_ns)

    def agree(self, path: HostPath) -> None:
        """Record that the board now sends its frames over this link."""
        self.carrier, self.pending = path, False

    def lose(self, path: HostPath, now_ns: int) -> list[Output]:
        """Record that a link is lost. If frames were wanted there, ask for them on another open link."""
        if self.carrier is path:
            self.carrier = None
        if self.wanted is not path:
            return []
        self.wanted, self.pending = None, False
        following = self.carrier or next((other for other in self._paths if other.is_open), None)
        return [] if following is None else self.want(following, now_ns)

    def end(self) -> None:
        """Record that the board has gone: no link carries frames, and none is wanted."""
        self.carrier = self.wanted = None
        self.pending = False

    def is_silent(self, path: HostPath, now_ns: int) -> bool:
        """Whether a link has been silent for too long. The carrier is given up sooner than other links, because frames must go on."""
        if now_ns - path.heard_ns >= path.silence_ns:
            return True
        return path is self.carrier and any(
            other.is_open and other.heard_ns - path.heard_ns >= SILENCE_BESIDE_NS for other in self._paths
        )

    def absent(self, absent_ns: int, now_ns: int) -> None:
        """Do not count the time in which this process did not run as waiting for an answer."""
        self._pending_since_ns = min(now_ns, self._pending_since_ns + absent_ns)

    def _insist(self, now_ns: int) -> list[Output]:
        """Say hello for frames on the wanted link, or give it up for another."""
        assert self.wanted is not None
        wanted = self.wanted
        others = [path for path in self._paths if path.is_open and path is not wanted]
        if others and now_ns - self._pending_since_ns >= STUCK_NS:
            if self.carrier is wanted:
                self.carrier = None
            after = [path for path in others if path.link > wanted.link]
            return [LinkDown(wanted.link, stuck=True), *self.want(self.carrier or (after or others)[0], now_ns)]
        self._hello_due_ns = now_ns + HELLO_RETRY_NS
        return [*wanted.say_hello(self._host_id, Lane.FRAMES)]
