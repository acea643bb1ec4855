"""When a host asks its board for the time over one link: waves of echoes, many at first, few later. Sans-I/O, `now_ns` passed in."""

from typing import Final

from common.protocol.message import Ping, Pong
from common.protocol.session import MS, Echo

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
