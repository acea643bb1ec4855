"""When a host asks its board for the time over one link: waves of echoes, many while little is known, few later. Sans-I/O, `now_ns` passed in."""

from typing import Final

from common.protocol.message import Ping, Pong
from common.protocol.session import MS, Echo

WAVE_ECHOES: Final = 3
WAVE_ECHOES_EARLY: Final = 5
"""Echoes back to back: the first wakes both sides up, the others measure without that bias (study of links, 3d)."""

WAVE_NS: Final = 500 * MS
"""Between two waves. An echo costs the board as much as half a frame (bench_link): 6 a second do for a clock whose skew is known."""

WAVE_STANDBY_NS: Final = 1000 * MS
"""The same on a link that carries no frames: it only has to be known as alive, and how far away it is."""

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

WAVE_HASTE_NS: Final = 10 * MS
"""Between the beginnings of two waves where something waits for an echo: a frame, or the end of a doubt."""

WAVE_PATIENCE_NS: Final = 1000 * MS
"""An echo under way is waited for this long before another wave: on a slow line a wave takes longer than the time between two."""

WAVE_REST: Final = 8
"""After a wave the line has this many times its length for other things: echoes at 115200 baud would else take 2 % of it."""

WAVE_REST_YOUNG: Final = 1
"""The same while the skew is learnt: 7 % of such a line for ten seconds."""


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
        """When `begin_wave` wants to be called next, host's clock, ns."""
        return self._due_ns

    def open(self, now_ns: int) -> None:
        """The link came up: echoes under way are of an earlier connection, perhaps of another clock."""
        self._wave += 1
        self._first_wave = self._wave
        self._echoes_left = 0
        self._kept.clear()
        self._unanswered = False
        self._opened_ns = self._due_ns = now_ns

    def hasten(self, now_ns: int) -> None:
        """Let the next wave begin as soon as one that is under way has ended."""
        if not self._unanswered:
            self._due_ns = min(self._due_ns, max(now_ns, self._wave_ns + WAVE_HASTE_NS))

    def begin_wave(self, now_ns: int, *, standby: bool) -> tuple[list[Echo], Ping | None]:
        """Begin a wave that is due.

        Args:
            now_ns: host's clock, ns.
            standby: whether the link carries no frames.

        Returns:
            Echoes of the wave before, if it was cut short, and the first question; None while the wave before is still under way.
        """
        if self._unanswered and now_ns - self._wave_ns < WAVE_PATIENCE_NS:
            self._due_ns = min(now_ns + WAVE_EARLY_NS, self._wave_ns + WAVE_PATIENCE_NS)
            return [], None
        self._wave_ns = now_ns
        age_ns = now_ns - self._opened_ns
        early = age_ns < EARLY_NS
        old_ns = WAVE_STANDBY_NS if standby else WAVE_NS
        self._due_ns = now_ns + (WAVE_EARLY_NS if early else WAVE_YOUNG_NS if age_ns < YOUNG_NS else old_ns)
        self._wave += 1
        self._echoes_left = WAVE_ECHOES_EARLY if early else WAVE_ECHOES
        self._repeats_left = REPEATS if EARLY_NS <= age_ns < YOUNG_NS else 0
        return self._given(), self._ping()

    def answered(self, pong: Pong, now_ns: int) -> tuple[list[Echo], Ping | None]:
        """Take an answer; one from before the link came up tells nothing, as it may be of another clock.

        One of an older wave is a fact like any other, but no further question follows it: where a round trip takes longer than a wave is waited for, all are.

        A swift echo is kept until its wave has ended. To learn from it takes longer than the echo did; the board's processor would rest meanwhile and wake
        late, so that every question travelled longer than its answer (decision 0009).

        Args:
            pong: the answer.
            now_ns: its arrival, host's clock, ns.

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
